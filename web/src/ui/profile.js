// The chart of a profile, over the lower part of the picture: heights by distance, told under the pointer, saved as CSV.
import { heightRange, profileCsv, scaledProfile, stretches, ticks } from '../profile.js';
import { height, length, plural } from '../words.js';
import { h, iconButton, setText, svg } from './dom.js';

const kHeight = 150; // CSS pixels
const kLeft = 52; // beside the plot: numbers of heights
const kRight = 14;
const kTop = 8;
const kBottom = 36; // below it: numbers of distances and the axis' name
const kTickPx = 70; // between numbers of distances, at least
const kHeightTicks = 4;
const kPadding = 0.06; // of the heights' range, above and below
const kSaved = 'profile.csv';

export class ProfileChart {
  // closed(): somebody has closed it
  constructor({ closed }) {
    this.drawn = null; // {key, profile: in metres or units, x, y, inMetres}
    this.told = h('span', { id: 'profile_told' });
    this.plot = h('div', { onpointermove: (e) => this.point(e), onpointerdown: (e) => this.point(e), onpointerleave: () => this.leave() });
    this.element = h('div', { id: 'profile', hidden: true, role: 'group', 'aria-label': 'Profile' },
      h('div', { className: 'head_row' }, h('b', {}, 'Profile'), this.told,
        h('button', { type: 'button', className: 'plain', onclick: () => this.save() }, 'Save as CSV'), iconButton('close', 'Close the profile', closed)),
      this.plot);
  }

  // profile: of profileAlong(), null for none. scale: {factor: from its unit, inMetres}
  update(profile, scale, isSparse) {
    this.element.hidden = !profile;
    if (!profile) {
      this.drawn = null;
      return;
    }
    const key = { profile, factor: scale.factor, inMetres: scale.inMetres, isSparse, width: this.plot.clientWidth };
    if (Object.keys(key).every((name) => this.drawn?.key[name] === key[name])) return;
    this.drawn = { key, profile: scaledProfile(profile, scale.factor), inMetres: scale.inMetres, isSparse };
    this.draw(key.width);
  }

  draw(width) {
    const { profile, inMetres } = this.drawn;
    const [low, high] = heightRange(profile);
    const padding = kPadding * (high - low) || 0.01 * profile.length;
    const [bottom, top] = [low - padding, high + padding];
    const [across, down] = [width - kLeft - kRight, kHeight - kTop - kBottom];
    this.drawn.x = (v) => kLeft + (across * v) / profile.length;
    this.drawn.y = (v) => kTop + (down * (top - v)) / (top - bottom);
    this.drawn.exaggeration = down / (top - bottom) / (across / profile.length);
    const unit = inMetres ? 'm' : 'units';
    this.cursor = svg('path', { class: 'profile_cursor' });
    this.plot.replaceChildren(svg('svg', { class: 'profile_plot', viewBox: `0 0 ${width} ${kHeight}`, width, height: kHeight, role: 'img', 'aria-label': this.summary() },
      this.heightAxis(ticks(bottom, top, kHeightTicks), width), this.distanceAxis(ticks(0, profile.length, Math.max(2, Math.floor(across / kTickPx)))),
      svg('text', { x: kLeft + across / 2, y: kHeight - 4, 'text-anchor': 'middle' }, `Distance, ${unit}`),
      svg('text', { x: 12, y: kTop + down / 2, 'text-anchor': 'middle', transform: `rotate(-90 12 ${kTop + down / 2})` }, `Height, ${unit}`),
      this.curves(), this.cursor));
    this.leave();
  }

  heightAxis(values, width) {
    const { y } = this.drawn;
    return values.flatMap((v) => [
      svg('line', { x1: kLeft, x2: width - kRight, y1: y(v), y2: y(v), class: 'profile_grid' }),
      svg('text', { x: kLeft - 6, y: y(v) + 4, 'text-anchor': 'end' }, number(v)),
    ]);
  }

  distanceAxis(values) {
    const { x } = this.drawn;
    return values.map((v) => svg('text', { x: x(v), y: kHeight - kBottom + 16, 'text-anchor': 'middle' }, number(v)));
  }

  // The straight line between the ends, from the lowest to the highest point, and the medians.
  curves() {
    const { profile, x, y } = this.drawn;
    const parts = stretches(profile.cells);
    const at = (cell, what) => `${x(cell.distance).toFixed(1)} ${y(cell[what]).toFixed(1)}`;
    const through = (cells, what) => cells.map((cell) => at(cell, what)).join('L');
    const band = parts.map((cells) => `M${through(cells, 'highest')}L${through([...cells].reverse(), 'lowest')}Z`).join('');
    const line = parts.map((cells) => `M${through(cells, 'height')}${cells.length === 1 ? 'h0' : ''}`).join('');
    return [
      svg('path', { class: 'profile_chord', d: `M${x(0)} ${y(profile.from)}L${x(profile.length)} ${y(profile.to)}` }),
      svg('path', { class: 'profile_band', d: band }), svg('path', { class: 'profile_line', d: line }),
    ];
  }

  summary() {
    const { profile, inMetres, isSparse, exaggeration } = this.drawn;
    const points = plural(profile.numPoints, isSparse ? 'sparse point' : 'point');
    const stretched = Number(exaggeration.toPrecision(2));
    return `${points} in a strip ${length(profile.width, inMetres)} wide; heights over the first point, drawn × ${stretched}`;
  }

  // The cell under the pointer.
  point({ clientX }) {
    if (!this.drawn) return;
    const { profile, x, y, inMetres } = this.drawn;
    const from = this.plot.getBoundingClientRect().left;
    const along = (clientX - from - x(0)) / (x(profile.length) - x(0));
    const i = Math.max(0, Math.min(profile.cells.length - 1, Math.floor(along * profile.cells.length)));
    const cell = profile.cells[i];
    const at = x(cell.distance).toFixed(1);
    this.cursor.setAttribute('d', `M${at} ${kTop}V${kHeight - kBottom}${cell.points ? `M${at} ${y(cell.height).toFixed(1)}m-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0` : ''}`);
    const where = `distance ${length(cell.distance, inMetres)}`;
    setText(this.told, cell.points ? `${where}, height ${height(cell.height, inMetres)}, ${plural(cell.points, 'point')}` : `${where}, no points`);
  }

  leave() {
    this.cursor?.setAttribute('d', '');
    if (this.drawn) setText(this.told, this.summary());
  }

  save() {
    const { profile, inMetres } = this.drawn;
    const url = URL.createObjectURL(new Blob([profileCsv(profile, inMetres ? 'm' : 'units')], { type: 'text/csv' }));
    h('a', { href: url, download: kSaved }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  }
}

const number = (v) => String(v).replace('-', '−');
