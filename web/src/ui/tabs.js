// The panels as tabs; on phones a sheet at the bottom that is closed, half or full.
import { byId, h, setText } from './dom.js';

const kSheets = ['peek', 'half', 'full'];
const kSheetLabels = { peek: 'Open the panels', half: 'Make the panels larger', full: 'Close the panels' };
const kDragPx = 24;

export class Tabs {
  // changed(): another panel is open
  constructor({ changed }) {
    this.changed = changed;
    this.tabs = new Map();
    this.current = null;
    const handle = byId('sheet_handle');
    handle.addEventListener('click', () => this.setSheet(kSheets[(this.sheet + 1) % kSheets.length]));
    this.dragBy(handle);
    this.setSheet('peek');
  }

  add(key, label, panel) {
    const badge = h('span', { className: 'badge' });
    const tab = h('button', {
      type: 'button', role: 'tab', id: `tab_${key}`, 'aria-controls': `panel_${key}`, onclick: () => this.open(key), onkeydown: (e) => this.key(e),
    }, label, badge);
    const box = h('div', { role: 'tabpanel', id: `panel_${key}`, 'aria-labelledby': `tab_${key}`, tabIndex: 0 }, panel.element);
    byId('tabs').append(tab);
    byId('tab_panels').append(box);
    this.tabs.set(key, { tab, box, badge, panel });
  }

  open(key, { keepSheet = false } = {}) {
    this.current = key;
    for (const [k, { tab, box }] of this.tabs) {
      tab.setAttribute('aria-selected', String(k === key));
      tab.tabIndex = k === key ? 0 : -1;
      box.hidden = k !== key;
    }
    if (!keepSheet && this.sheet === 0) this.setSheet('half');
    this.changed();
  }

  key(e) {
    const keys = [...this.tabs.keys()];
    const at = keys.indexOf(this.current);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1 + keys.length, Home: 0, End: keys.length - 1 }[e.key];
    if (to === undefined) return;
    e.preventDefault();
    const key = keys[to % keys.length];
    this.open(key);
    this.tabs.get(key).tab.focus();
  }

  // Only the panel that is seen.
  update(view) {
    this.tabs.get(this.current).panel.update(view);
  }

  setBadge(key, text) {
    setText(this.tabs.get(key).badge, text);
  }

  get sheet() {
    return kSheets.indexOf(document.body.dataset.sheet);
  }

  setSheet(sheet) {
    document.body.dataset.sheet = sheet;
    byId('sheet_handle').setAttribute('aria-label', kSheetLabels[sheet]);
  }

  // Up opens, down closes; the click that ends a drag does nothing.
  dragBy(handle) {
    let from = null;
    handle.addEventListener('pointerdown', (e) => {
      from = e.clientY;
      handle.setPointerCapture(e.pointerId);
    });
    handle.addEventListener('pointerup', (e) => {
      const moved = from === null ? 0 : from - e.clientY;
      from = null;
      if (Math.abs(moved) < kDragPx) return;
      this.setSheet(kSheets[Math.max(0, Math.min(kSheets.length - 1, this.sheet + Math.sign(moved)))]);
      handle.addEventListener('click', (c) => c.stopImmediatePropagation(), { once: true, capture: true });
    });
  }
}
