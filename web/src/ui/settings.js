// What is shown, and how large: a button that opens it.
import { h, iconButton } from './dom.js';

export class Settings {
  // on: {pointPx(px), cameraScale(f), show('points' | 'cameras' | 'grid', on), stations(on), tintMaps(on), confidence(on), section(on)}
  constructor(on) {
    this.section = check('Section: hide points outside a box', (active) => {
      if (active) this.toggle(); // what it opens has the place
      on.section(active);
    }, false);
    this.element = h('div', { id: 'settings', hidden: true, role: 'group', 'aria-label': 'What is shown' },
      range('Point size', { min: 1, max: 8, step: 0.5, value: 3 }, on.pointPx),
      range('Camera size', { min: 0, max: 3, step: 0.1, value: 1 }, on.cameraScale),
      check('Points or surface', (visible) => on.show('points', visible)),
      check('Cameras', (visible) => on.show('cameras', visible)),
      check('Photos to take', on.stations),
      check('Floor grid', (visible) => on.show('grid', visible)),
      check('Tell maps apart by colour', on.tintMaps),
      check('Confidence', on.confidence, false),
      this.section);
    this.button = iconButton('layers', 'What is shown', () => this.toggle(), { id: 'tool_layers', 'aria-expanded': 'false', 'aria-controls': 'settings' });
  }

  sectionEnded() {
    this.section.querySelector('input').checked = false;
  }

  toggle() {
    this.element.hidden = !this.element.hidden;
    this.button.setAttribute('aria-expanded', String(!this.element.hidden));
  }
}

const range = (label, properties, oninput) =>
  h('label', {}, h('span', {}, label), h('input', { type: 'range', oninput: (e) => oninput(Number(e.target.value)), ...properties }));
const check = (label, onchange, checked = true) =>
  h('label', { className: 'check' }, h('input', { type: 'checkbox', checked, onchange: (e) => onchange(e.target.checked) }), label);
