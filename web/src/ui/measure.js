// Distance of two points of one map; a length that somebody knows gives that map its scale.
import { Scales } from '../scales.js';
import * as sim from '../similarity.js';
import { degrees, length } from '../words.js';
import { byId, h, setText } from './dom.js';

const kPress = globalThis.matchMedia?.('(pointer: coarse)').matches ? 'Tap' : 'Click';

export class Measure {
  constructor({ viewer, world, timeline, notice, changed }) {
    Object.assign(this, { viewer, world, timeline, notice, changed });
    this.active = false;
    this.picked = []; // {submap, own}: in the submap's frame, so that they stay on their map, wherever that goes
    this.scales = new Scales();
    this.known = new Map(); // submap: metres per unit of its frame; the latest last
    this.input = h('input', { type: 'number', min: '0', step: 'any', inputmode: 'decimal' });
    this.keptNote = h('span', { className: 'muted' });
    this.ask = h('div', {}, h('label', {}, h('span', {}, 'True length, m'), this.input), h('button', { type: 'submit', className: 'strong' }, 'Set scale'));
    this.given = h('div', {}, this.keptNote, h('button', { type: 'button', onclick: () => this.forget() }, 'Forget it'));
    this.done = h('button', { type: 'button', id: 'measure_done', className: 'plain', onclick: () => this.setActive(false) }, 'Done');
    this.form = h('form', { id: 'known_length', hidden: true, onsubmit: (e) => this.setLength(e) }, this.ask, this.given);
    addEventListener('storage', (e) => {
      if (this.scales.heard(e.key)) this.scaleChanged();
    });
  }

  // Of the session that is shown from now on.
  begin(session) {
    this.scales.open(session);
    this.scaleChanged();
  }

  scaleChanged() {
    this.known = this.scales.bySubmap(this.timeline.live);
    if (this.active && this.picked.length === 2) this.tell();
    this.changed();
  }

  setLength(event) {
    event.preventDefault();
    const metres = Number(this.input.value);
    const [a, b] = this.picked;
    const own = sim.distance(a.own, b.own);
    const submap = this.timeline.live.submaps.get(a.submap);
    if (!(metres > 0) || !Number.isFinite(metres) || !(own > 0) || !submap) {
      this.notice('Give a length above 0 in metres, with two points that are apart.');
      return;
    }
    this.scales.set(submap, metres / own);
    this.input.value = '';
    this.scaleChanged();
  }

  forget() {
    this.scales.forget(this.timeline.live, this.picked[0].submap);
    this.scaleChanged();
  }

  tell() {
    this.notice(`${this.words()}. ${kPress} again to measure anew.`);
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
    document.body.classList.toggle('measuring', on); // a phone then shows little but the map
    this.notice(on ? `Measure: ${kPress.toLowerCase()} the first point.` : '');
    this.changed();
  }

  pick(hit) {
    if (!hit?.own) {
      this.notice(`No point there: zoom in and ${kPress.toLowerCase()} one of the points.`);
      return;
    }
    if (this.picked.length === 2) this.picked = [];
    const [first] = this.picked;
    if (first && first.submap !== hit.submap) {
      this.notice('That is another map: there is no distance between maps that are not joined. Choose a point of the first one.');
      return;
    }
    this.picked.push({ submap: hit.submap, own: hit.own });
    if (this.picked.length === 2) this.tell();
    else this.notice(`${this.whereIs(hit)}${kPress} the second point.`);
    this.changed();
  }

  // Where GPS tells.
  whereIs({ submap, own }) {
    const at = this.world.coordinatesOf(submap, own);
    return at ? `${degrees(at)}. ` : '';
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
      this.notice('The map of these points has changed: choose the first point again.');
    }
    this.known = this.scales.bySubmap(this.timeline.live); // maps are joined
    this.form.hidden = !this.active || this.picked.length < 2;
    this.given.hidden = !this.known.has(this.picked[0]?.submap);
    this.ask.hidden = !this.given.hidden;
    setText(this.keptNote, this.scales.kept ? 'This browser keeps the scale for this session.' : 'The scale lasts until the page is left: the browser keeps nothing.');
    this.viewer.setMeasure(points ?? [], colour);
  }

  // {text, point} over the middle of the line; null if there is none.
  label() {
    const points = this.picked.length === 2 ? this.points() : null;
    return points && { text: this.words(), point: sim.scaled(sim.add(...points), 0.5) };
  }
}
