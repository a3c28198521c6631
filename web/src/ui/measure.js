// Distance of two points of one map; a length that somebody knows gives that map its scale, until the page is left.
import * as sim from '../similarity.js';
import { length } from '../words.js';
import { byId, h } from './dom.js';

export class Measure {
  constructor({ viewer, world, notice, changed }) {
    Object.assign(this, { viewer, world, notice, changed });
    this.active = false;
    this.picked = []; // {submap, own}: in the submap's frame, so that they stay on their map, wherever that goes
    this.known = new Map(); // submap: metres per unit of its frame; the latest last
    this.input = h('input', { type: 'number', min: '0', step: 'any', inputmode: 'decimal' });
    this.form = h('form', { id: 'known_length', hidden: true, onsubmit: (e) => this.setLength(e) },
      h('label', {}, h('span', {}, 'True length, m'), this.input), h('button', { type: 'submit' }, 'Set the scale'));
  }

  setLength(event) {
    event.preventDefault();
    const metres = Number(this.input.value);
    const [a, b] = this.picked;
    const own = sim.distance(a.own, b.own);
    if (!(metres > 0) || !Number.isFinite(metres) || !(own > 0)) {
      this.notice('Give a length above 0 in metres, with two points that are apart.');
      return;
    }
    this.known.delete(a.submap);
    this.known.set(a.submap, metres / own);
    this.input.value = '';
    this.notice(`${this.words()}. Click again to measure anew.`);
    this.changed();
  }

  // Metres per unit of the display by the latest known length of a map that is shown; undefined where there is none.
  metresPerUnit() {
    for (const [submap, metres] of [...this.known].reverse()) {
      const place = this.viewer.submaps.goalOf(submap);
      if (place) return metres / place.s;
    }
    return undefined;
  }

  setActive(on) {
    this.active = on;
    this.picked = [];
    byId('tool_measure').setAttribute('aria-pressed', String(on));
    this.notice(on ? 'Measure: click the first point.' : '');
    this.changed();
  }

  pick(hit) {
    if (!hit?.own) {
      this.notice('No point there: zoom in and click one of the points.');
      return;
    }
    if (this.picked.length === 2) this.picked = [];
    const [first] = this.picked;
    if (first && first.submap !== hit.submap) {
      this.notice('That is another map: there is no distance between maps that are not joined. Click a point of the first one.');
      return;
    }
    this.picked.push({ submap: hit.submap, own: hit.own });
    this.notice(this.picked.length === 2 ? `${this.words()}. Click again to measure anew.` : 'Click the second point.');
    this.changed();
  }

  words() {
    const [a, b] = this.picked;
    const own = sim.distance(a.own, b.own);
    const known = this.known.get(a.submap);
    if (known) return `${length(own * known, true)} (scale from a known length)`;
    const geo = this.world.measures.get(a.submap)?.measure.geo;
    if (geo) return `${length(own * geo.localFromSubmap.s, true)} (scale from GPS)`;
    return length(own * (this.viewer.submaps.placeOf(a.submap)?.s ?? 1), false);
  }

  // In the display's frame; null where the map of the points was joined to another one.
  points() {
    const points = this.picked.map(({ submap, own }) => {
      const place = this.viewer.submaps.placeOf(submap);
      return place && sim.apply(place, own);
    });
    return points.every(Boolean) ? points : null;
  }

  update(colour) {
    const points = this.points();
    if (!points) {
      this.picked = [];
      this.notice('The map of these points has changed: click the first point again.');
    }
    this.form.hidden = !this.active || this.picked.length < 2;
    this.viewer.setMeasure(points ?? [], colour);
  }

  // {text, point} over the middle of the line; null if there is none.
  label() {
    const points = this.picked.length === 2 ? this.points() : null;
    return points && { text: this.words(), point: sim.scaled(sim.add(...points), 0.5) };
  }
}
