// The section's panel: for each axis two sliders, of the lower and of the upper bound, and where they are.
import { boundAt, displayBox, isUnbounded, rangesOf, stepOf, unbounded, within } from '../section.js';
import { h, iconButton, setText } from './dom.js';

const kSteps = 200; // of a slider
const kByCompass = ['East', 'North', 'Up'];
const kByMap = ['Sideways', 'Forward', 'Up'];

export class Section {
  // on: {changed(), closed()}; metresPerUnit(): of the display; undefined where nothing tells
  constructor({ viewer, world, metresPerUnit, on }) {
    Object.assign(this, { viewer, world, metresPerUnit, on });
    this.active = false;
    this.bounds = unbounded(); // along the axes of section.js
    this.ranges = null;
    this.rows = kByMap.map((_, axis) => this.makeRow(axis));
    this.note = h('small', {});
    this.resetButton = h('button', { type: 'button', className: 'plain', onclick: () => this.reset() }, 'Reset');
    this.element = h('div', { id: 'section', hidden: true, role: 'group', 'aria-label': 'Section' },
      h('div', { className: 'head_row' }, h('b', {}, 'Section'), this.resetButton, iconButton('close', 'End the section: show all points', () => this.setActive(false))),
      this.rows.map((row) => row.element), this.note);
  }

  makeRow(axis) {
    const [name, told] = [h('span', {}), h('span', { className: 'muted' })];
    const slider = (side) => h('input', {
      type: 'range', min: 0, max: kSteps, step: 1, value: side * kSteps, oninput: (e) => this.moveBound(axis, side, Number(e.target.value)),
    });
    const sliders = [slider(0), slider(1)];
    return { name, told, sliders, element: h('div', { className: 'axis' }, name, told, ...sliders) };
  }

  setActive(on) {
    this.active = on;
    this.element.hidden = !on;
    if (!on) this.on.closed();
    this.on.changed();
  }

  reset() {
    this.bounds = unbounded();
    this.on.changed();
  }

  // One step at least stays between the bounds of an axis: the other one gives way.
  moveBound(axis, side, wanted) {
    if (!this.ranges) return;
    const range = this.ranges[axis];
    const at = side === 0 ? Math.min(wanted, kSteps - 1) : Math.max(wanted, 1);
    const other = stepOf(range, this.bounds[axis][1 - side], kSteps);
    this.bounds[axis][side] = boundAt(range, side, at, kSteps);
    if (side === 0 && other <= at) this.bounds[axis][1] = boundAt(range, 1, at + 1, kSteps);
    if (side === 1 && other >= at) this.bounds[axis][0] = boundAt(range, 0, at - 1, kSteps);
    this.on.changed();
  }

  update(colour) {
    this.ranges = this.active ? rangesOf(this.viewer.extent().points) : null;
    if (!this.ranges) {
      this.viewer.setSection(null);
      return;
    }
    this.viewer.setSection(isUnbounded(this.bounds) ? null : displayBox(this.bounds), displayBox(within(this.bounds, this.ranges)), colour);
    this.resetButton.disabled = isUnbounded(this.bounds);
    const knowsNorth = this.world.knowsNorth();
    this.rows.forEach((row, axis) => this.updateRow(row, axis, (knowsNorth ? kByCompass : kByMap)[axis]));
    setText(this.note, knowsNorth ? 'From the middle of the map, and from its floor.' : 'From the middle of the map, and from its floor; forward is where its photos look.');
  }

  updateRow({ name, told, sliders }, axis, word) {
    const metres = this.metresPerUnit();
    const shown = within(this.bounds, this.ranges)[axis].map((v) => v * (metres ?? 1));
    const digits = shown[1] - shown[0] < 10 ? 2 : 1;
    const [low, high] = shown.map((v) => v.toFixed(digits).replace('-', '−'));
    const unit = metres === undefined ? 'units' : 'm';
    setText(name, word);
    setText(told, `${low} to ${high} ${unit}`);
    sliders.forEach((slider, side) => {
      slider.value = stepOf(this.ranges[axis], this.bounds[axis][side], kSteps);
      slider.setAttribute('aria-label', `${word}, ${side === 0 ? 'from' : 'to'}`);
      slider.setAttribute('aria-valuetext', `${[low, high][side]} ${unit}`);
    });
  }
}
