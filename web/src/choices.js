// What the visitor chose, kept in this browser for all sessions.

// One of `choices`; null where none was made.
export function storedChoice(name, choices) {
  try {
    const choice = localStorage.getItem(`skein.${name}`);
    return choices.includes(choice) ? choice : null;
  } catch {
    return null; // storage may be forbidden
  }
}

// null: none any more.
export function storeChoice(name, choice) {
  try {
    if (choice) localStorage.setItem(`skein.${name}`, choice);
    else localStorage.removeItem(`skein.${name}`);
  } catch {
    // Then it lasts as long as the page.
  }
}

export const storedTheme = () => storedChoice('theme', ['dark', 'light']); // null: as the system says
export const systemTheme = () => (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark');
