// Elements from code. Text goes in as text only: names come from agents and files.

const kProperties = new Set(['value', 'checked', 'disabled', 'hidden', 'open', 'indeterminate', 'tabIndex', 'htmlFor', 'className']);

function set(element, name, value) {
  if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
  else if (kProperties.has(name)) element[name] = value;
  else if (name === 'dataset') Object.assign(element.dataset, value);
  else if (value === true) element.setAttribute(name, '');
  else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, String(value));
}

// h('li', {className: 'row'}, 'text', element, null, [more])
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) set(element, name, value);
  element.append(...children.flat().filter((c) => c !== null && c !== undefined && c !== false));
  return element;
}

export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) element.setAttribute(name, String(value));
  }
  element.append(...children.flat().filter(Boolean));
  return element;
}

export const byId = (id) => document.getElementById(id);

// Changes text only where it differs, so that selections and screen readers are left alone.
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// Text in which `...` is code, as nodes.
export const withCode = (text) => text.split('`').map((part, i) => (i % 2 ? h('code', {}, part) : part));

// Children of `container` for `items`, by key: kept, moved, made and removed as needed. Items with one key have an element each, in
// their order.
export function keyed(container, items, keyOf, create, update) {
  container.keyed ??= new Map(); // key -> elements
  const old = container.keyed;
  const now = new Map();
  let before = null;
  for (const item of items) {
    const key = keyOf(item);
    const element = old.get(key)?.shift() ?? create(item);
    update?.(element, item);
    const place = before ? before.nextSibling : container.firstChild;
    if (place !== element) container.insertBefore(element, place);
    if (!now.has(key)) now.set(key, []);
    now.get(key).push(element);
    before = element;
  }
  for (const element of [...old.values()].flat()) element.remove();
  container.keyed = now;
}

const kIcons = {
  fit: 'M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5M9 12h6M12 9v6',
  follow: 'M12 3v4M12 17v4M3 12h4M17 12h4M12 8a4 4 0 1 0 0 8a4 4 0 0 0 0-8',
  fly: 'M3 12l18-8-6 17-4-7z',
  measure: 'M3 16L16 3l5 5L8 21zM7 12l2 2M10 9l2 2M13 6l2 2',
  surface: 'M3 17l5-4 5 3 8-6M3 17V9l5-4 5 3 8-6v8M8 5v8M13 8v8',
  layers: 'M12 3l9 5-9 5-9-5zM3 13l9 5 9-5',
  theme: 'M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 0 1 0 18',
  help: 'M9 9a3 3 0 1 1 4 3c-1 .5-1 1-1 2M12 17.5v.5M12 3a9 9 0 1 0 0 18a9 9 0 0 0 0-18',
  invite: 'M9 11a4 4 0 1 0 0-8a4 4 0 0 0 0 8M2 21c0-4 3-7 7-7s7 3 7 7M19 7v6M16 10h6',
  play: 'M7 4l13 8-13 8z',
  pause: 'M7 4v16M17 4v16',
  close: 'M5 5l14 14M19 5L5 19',
  download: 'M12 3v12M7 11l5 5 5-5M4 20h16',
  look: 'M2 12s4-7 10-7 10 7 10 7-4 7-10 7S2 12 2 12zM12 9a3 3 0 1 0 0 6a3 3 0 0 0 0-6',
};

export function icon(name) {
  return svg('svg', { viewBox: '0 0 24 24', class: 'icon', 'aria-hidden': 'true' }, svg('path', { d: kIcons[name] }));
}

export function iconButton(name, label, onclick, properties = {}) {
  return h('button', { type: 'button', className: 'icon_button', 'aria-label': label, title: label, onclick, ...properties }, icon(name));
}
