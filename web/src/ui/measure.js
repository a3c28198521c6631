// Distance of two points of one map.
import * as sim from '../similarity.js';
import { length } from '../words.js';
import { byId } from './dom.js';

export class Measure {
  constructor({ viewer, world, notice, changed }) {
    Object.assign(this, { viewer, world, notice, changed });
    this.active = false;
    this.picked = []; // {submap, own}: in the submap's frame, so that they stay on their map, wherever that goes
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
    this.viewer.setMeasure(points ?? [], colour);
  }

  // {text, point} over the middle of the line; null if there is none.
  label() {
    const points = this.picked.length === 2 ? this.points() : null;
    return points && { text: this.words(), point: sim.scaled(sim.add(...points), 0.5) };
  }
}
