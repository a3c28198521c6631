// Distance of two points of one map, or area of a polygon on its points and volume over that; a length that somebody knows
// gives the map its scale. Between two points there is a profile.
import { profileAlong } from '../profile.js';
import { Scales } from '../scales.js';
import * as sim from '../similarity.js';
import { measureHeap } from '../volume.js';
import { degrees, heapWords, height, length } from '../words.js';
import { byId, h, setText } from './dom.js';
import { ProfileChart } from './profile.js';

const kPress = globalThis.matchMedia?.('(pointer: coarse)').matches ? 'Tap' : 'Click';
const kClosePx = 16; // from the first corner: there a polygon is closed
const kAgainMs = 2000; // between two measurements of a map that grows, or ten times as long as one takes

export class Measure {
  constructor({ viewer, world, timeline, notice, changed }) {
    Object.assign(this, { viewer, world, timeline, notice, changed });
    this.active = false;
    this.isArea = false; // of a polygon, else a distance
    this.heap = null; // of measureHeap(), while the polygon is closed
    this.profile = null; // of profileAlong(), while its chart is open
    this.last = null; // {changes, at, took, isSparse}: of the points that one of these was measured on
    this.again = null; // the timer of the next measurement
    this.picked = []; // {submap, own}: in the submap's frame, so that they stay on their map, wherever that goes
    this.scales = new Scales();
    this.known = new Map(); // submap: metres per unit of its frame; the latest last
    this.input = h('input', { type: 'number', min: '0', step: 'any', inputmode: 'decimal' });
    this.keptNote = h('span', { className: 'muted' });
    this.ask = h('div', {}, h('label', {}, h('span', {}, 'True length, m'), this.input), h('button', { type: 'submit', className: 'strong' }, 'Set scale'));
    this.given = h('div', {}, this.keptNote, h('button', { type: 'button', onclick: () => this.forget() }, 'Forget it'));
    this.done = h('button', { type: 'button', id: 'measure_done', className: 'plain', onclick: () => this.setActive(false) }, 'Done');
    this.makeTools();
    this.profileButton = h('button', { type: 'button', id: 'measure_profile', onclick: () => this.toggleProfile() }, 'Profile');
    this.chart = new ProfileChart({ closed: () => this.toggleProfile() });
    this.form = h('form', { id: 'known_length', hidden: true, onsubmit: (e) => this.setLength(e) }, this.ask, this.given, this.profileButton);
    addEventListener('storage', (e) => {
      if (this.scales.heard(e.key)) this.scaleChanged();
    });
  }

  makeTools() {
    const tool = (name, label, onclick) => h('button', { type: 'button', id: `measure_${name}`, className: 'plain', onclick }, label);
    this.area = tool('area', 'Area', () => this.setArea(!this.isArea));
    this.undo = tool('undo', 'Undo', () => this.takeBack());
    this.close = tool('close', 'Close', () => this.closeArea());
    this.tools = h('div', { id: 'measure_tools', hidden: true, role: 'group', 'aria-label': 'Measure' }, this.area, this.undo, this.close);
  }

  // Of the session that is shown from now on.
  begin(session) {
    this.scales.open(session);
    this.scaleChanged();
  }

  scaleChanged() {
    this.known = this.scales.bySubmap(this.timeline.live);
    if (this.active && this.isWhole()) this.tell();
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

  isWhole() {
    return this.isArea ? this.heap !== null : this.picked.length === 2;
  }

  tell() {
    this.notice(`${this.words().slice(0, 2).join(', ')}. ${kPress} again to measure anew.`);
  }

  // What is to be picked next.
  askNext(before = '') {
    const n = this.picked.length;
    if (!this.isArea) this.notice(n ? `${before}${kPress} the second point.` : `Measure: ${kPress.toLowerCase()} the first point.`);
    else if (n === 0) this.notice(`Area: ${kPress.toLowerCase()} the first corner.`);
    else this.notice(`${before}${kPress} the next corner${n < 3 ? '' : ', or the first one to close the area'}.`);
  }

  // Of the display, by a known length or GPS; undefined where neither tells.
  displayMetres() {
    return this.metresPerUnit() ?? this.world.metresPerUnit()?.metres;
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
    this.isArea = false;
    this.restart();
    byId('tool_measure').setAttribute('aria-pressed', String(on));
    document.body.classList.toggle('measuring', on); // a phone then shows little but the map
    if (on) this.askNext();
    else this.notice('');
    this.changed();
  }

  restart() {
    this.picked = [];
    this.heap = this.profile = null;
  }

  // A point that was picked for a distance is the first corner.
  setArea(on) {
    this.isArea = on;
    if (!on) this.restart();
    this.askNext();
    this.changed();
  }

  pick(hit) {
    if (!hit?.own) {
      this.notice(`No point there: zoom in and ${kPress.toLowerCase()} one of the points.`);
      return;
    }
    if (this.isWhole()) this.restart();
    const [first] = this.picked;
    if (first && first.submap !== hit.submap) {
      this.notice('That is another map: nothing is measured between maps that are not joined. Choose a point of the first one.');
      return;
    }
    if (this.isArea && this.isFirst(hit)) {
      this.closeArea();
      return;
    }
    this.add(hit);
  }

  add(hit) {
    const last = this.picked.at(-1);
    if (this.isArea && last && sim.distance(last.own, hit.own) === 0) return; // of a double click
    this.picked.push({ submap: hit.submap, own: hit.own });
    if (this.isWhole()) this.tell();
    else this.askNext(this.whereIs(hit));
    this.changed();
  }

  // Whether a hit is where the first of enough corners is seen.
  isFirst(hit) {
    if (this.picked.length < 3) return false;
    const [a, b] = [this.points()?.[0], hit.point].map((point) => point && this.viewer.project(point));
    return Boolean(a && b) && Math.hypot(a.x - b.x, a.y - b.y) < kClosePx;
  }

  closeArea() {
    this.measureArea();
    if (this.heap) this.tell();
    else this.notice('No area: its sides cross, or its corners lie on a line. Undo takes the last corner back.');
    this.changed();
  }

  // A closed polygon is opened; an open one loses its last corner.
  takeBack() {
    if (this.heap) this.heap = null;
    else this.picked.pop();
    this.askNext();
    this.changed();
  }

  measureArea() {
    const corners = this.picked.map(({ own }) => own);
    this.heap = this.onPoints((up, eachPoint) => measureHeap(corners, up, eachPoint));
  }

  toggleProfile() {
    if (this.profile) this.profile = null;
    else this.measureProfile();
    this.changed();
  }

  measureProfile() {
    const [a, b] = this.picked;
    this.profile = this.onPoints((up, eachPoint) => profileAlong(a.own, b.own, up, eachPoint));
    if (!this.profile) this.notice('No profile: the two points stand over each other. Choose two that are apart as seen from above.');
  }

  // measure(up, eachPoint) on the visible points of the map of what was picked.
  onPoints(measure) {
    const { submaps } = this.viewer;
    const [{ submap }] = this.picked;
    const { changes } = submaps;
    const began = performance.now();
    const result = measure(this.upOf(submap), (visit) => submaps.eachPoint(submap, visit));
    const at = performance.now();
    this.last = { changes, at, took: at - began, isSparse: !submaps.showsSurface(submap) };
    return result;
  }

  // The map goes on growing while its area or profile is shown.
  measureAgain() {
    if (!(this.heap || this.profile) || this.last.changes === this.viewer.submaps.changes) return;
    const wait = this.last.at + Math.max(kAgainMs, 10 * this.last.took) - performance.now();
    if (wait > 0) {
      this.again ??= setTimeout(() => {
        this.again = null;
        this.changed();
      }, wait);
      return;
    }
    if (this.heap) this.closeArea();
    else this.measureProfile();
  }

  // Where GPS tells.
  whereIs({ submap, own }) {
    const at = this.world.coordinatesOf(submap, own);
    return at ? `${degrees(at)}. ` : '';
  }

  // The display's direction up in the frame of a submap: as GPS tells, else as the cameras were held.
  upOf(submap) {
    return sim.rotate(sim.conjugate(this.viewer.submaps.goalOf(submap)?.q ?? [1, 0, 0, 0]), [0, 1, 0]);
  }

  // Of a submap's frame: {factor, inMetres, source}, as heapWords() takes it.
  scaleOf(submap) {
    const known = this.known.get(submap);
    if (known) return { factor: known, inMetres: true, source: ' (scale from a known length)' };
    const geo = this.world.measures.get(submap)?.measure.geo;
    if (geo) return { factor: geo.localFromSubmap.s, inMetres: true, source: ' (scale from GPS)' };
    return { factor: this.viewer.submaps.placeOf(submap)?.s ?? 1, inMetres: false, source: '' };
  }

  // Of a whole measurement, line by line.
  words() {
    const scale = this.scaleOf(this.picked[0].submap);
    return this.isArea ? heapWords(this.heap, scale, this.last.isSparse) : this.distanceWords(scale);
  }

  distanceWords({ factor, inMetres, source }) {
    const [a, b] = this.picked;
    const rise = sim.dot(this.upOf(a.submap), sim.subtract(b.own, a.own));
    const isSure = Number.isFinite(this.world.coordinatesOf(a.submap, a.own)?.altitude);
    return [
      `${length(factor * sim.distance(a.own, b.own), inMetres)}${source}`,
      `height ${isSure ? '' : 'about '}${height(factor * rise, inMetres)}`,
    ];
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
      this.restart();
      this.notice('The map of these points has changed: choose the first point again.');
    }
    this.known = this.scales.bySubmap(this.timeline.live); // maps are joined
    this.form.hidden = !this.active || this.isArea || this.picked.length < 2;
    this.updateTools();
    this.given.hidden = !this.known.has(this.picked[0]?.submap);
    this.ask.hidden = !this.given.hidden;
    setText(this.keptNote, this.scales.kept ? 'This browser keeps the scale for this session.' : 'The scale lasts until the page is left: the browser keeps nothing.');
    this.measureAgain();
    this.profileButton.setAttribute('aria-pressed', String(this.profile !== null));
    this.chart.update(this.profile, this.profile && this.scaleOf(this.picked[0].submap), this.last?.isSparse);
    this.viewer.setMeasure(points ?? [], colour, this.heap !== null);
  }

  updateTools() {
    this.tools.hidden = !this.active || !this.form.hidden;
    this.area.setAttribute('aria-pressed', String(this.isArea));
    this.undo.hidden = this.close.hidden = !this.isArea;
    this.undo.disabled = this.picked.length === 0;
    this.close.disabled = this.picked.length < 3 || this.heap !== null;
  }

  // {text, point} over the middle of the line or of the corners; null if there is none.
  label() {
    const points = this.isWhole() ? this.points() : null;
    return points && { text: this.words().join('\n'), point: sim.scaled(points.reduce(sim.add), 1 / points.length) };
  }
}
