// Dark or light, as the visitor chose it; null: as the system says.
export function storedTheme() {
  try {
    const theme = localStorage.getItem('skein.theme');
    return theme === 'dark' || theme === 'light' ? theme : null;
  } catch {
    return null; // storage may be forbidden
  }
}

export function storeTheme(theme) {
  try {
    if (theme) localStorage.setItem('skein.theme', theme);
    else localStorage.removeItem('skein.theme');
  } catch {
    // Then it lasts as long as the page.
  }
}
