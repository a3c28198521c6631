// What stands where photos were taken, or are to be taken: frusta, the photos on them, and the lines between them. All is
// set in the frames of submaps and follows them.
import { Vector3 } from 'three';
import * as sim from '../similarity.js';
import { Frusta, Segments } from './lines.js';
import { Pictures } from './pictures.js';

export class Cameras {
  constructor(scene, submaps, changed) {
    Object.assign(this, { submaps, changed });
    this.frusta = new Frusta();
    this.links = new Segments({ width: 1.6 });
    this.stationFrusta = new Frusta(); // their faces are not drawn: they are not picked
    this.ways = new Segments({ width: 1.6 });
    scene.add(this.frusta.lines, this.frusta.fill, this.links, this.stationFrusta.lines, this.ways);
    this.pictures = new Pictures(scene, changed);
    this.all = []; // as set
    this.stations = []; // the same
    this.wantedLinks = []; // the same
    this.placed = new Map(); // image -> {image, centre, q, size, colour}, in the display's frame
    this.stale = false; // something changed since they were placed
    this.base = 0.42; // depth of a frustum
    this.scale = 1;
    this.visible = true;
  }

  // [{image, submap, centre, worldFromCam: in the submap's frame, aspect: tan of half the angles, colour: [r, g, b],
  // alpha, emphasis}]
  set(cameras) {
    if (cameras.length === this.all.length && cameras.every((c, i) => isSameCamera(c, this.all[i]))) return;
    this.all = cameras;
    this.change();
  }

  // Where the submaps are now.
  place() {
    this.stale = false;
    for (const { uniforms } of [this.frusta, this.stationFrusta]) uniforms.uScale.value = this.scale;
    this.placed = new Map();
    const shown = [];
    for (const camera of this.all) {
      const place = this.submaps.placeOf(camera.submap);
      if (!place) continue;
      const depth = this.base * (camera.emphasis ? 1.45 : 1);
      const entry = {
        image: camera.image,
        centre: sim.apply(place, camera.centre),
        q: sim.multiply(place.q, camera.worldFromCam),
        size: [camera.aspect[0] * depth, camera.aspect[1] * depth, depth],
        colour: [...camera.colour, camera.emphasis ? 1 : camera.alpha ?? 0.85],
      };
      this.placed.set(camera.image, entry);
      shown.push(entry);
    }
    this.frusta.set(this.visible ? shown : []);
    this.placeStations();
    this.placeLinks();
    this.pictures.place(this.placed, this);
  }

  // Photos to take: as cameras, and `from` the image that an arrow leads from.
  setStations(stations) {
    if (JSON.stringify(stations) === JSON.stringify(this.stations)) return;
    this.stations = stations;
    this.change();
  }

  placeStations() {
    const shown = [];
    const arrows = [];
    const depth = 1.2 * this.base;
    for (const station of this.stations) {
      const place = this.submaps.placeOf(station.submap);
      if (!place) continue;
      const centre = sim.apply(place, station.centre);
      const colour = [...station.colour, station.alpha];
      shown.push({ centre, q: sim.multiply(place.q, station.worldFromCam), size: [station.aspect[0] * depth, station.aspect[1] * depth, depth], colour });
      const from = this.placed.get(station.from)?.centre;
      if (from) arrows.push(...arrow(from, centre, colour));
    }
    this.stationFrusta.set(shown);
    this.ways.set(arrows);
  }

  // Lines between cameras: [{from, to: image ids, colour: [r, g, b, a]}]
  setLinks(links) {
    if (JSON.stringify(links) === JSON.stringify(this.wantedLinks)) return;
    this.wantedLinks = links;
    this.placeLinks();
    this.changed();
  }

  placeLinks() {
    const segments = [];
    for (const { from, to, colour } of this.wantedLinks) {
      const a = this.placed.get(from);
      const b = this.placed.get(to);
      if (a && b) segments.push({ from: a.centre, to: b.centre, colour });
    }
    this.links.set(segments);
  }

  // Cameras are as large as a step between photos, and large enough to be seen in the whole.
  setBase(base) {
    if (Math.abs(base - this.base) < 0.1 * base) return;
    this.base = base;
    this.change();
  }

  setScale(scale) {
    this.scale = scale;
    this.change();
  }

  show(visible) {
    this.visible = visible;
    this.change();
  }

  // They are placed anew with the next frame.
  change() {
    this.stale = true;
    this.changed();
  }

  resize(width, height, ratio) {
    for (const lines of [this.frusta, this.stationFrusta, this.ways, this.links]) lines.resize(width, height, ratio);
  }
}

// A line with a head.
function arrow(from, to, colour) {
  const [a, b] = [new Vector3(...from), new Vector3(...to)];
  const along = b.clone().sub(a);
  const length = along.length();
  if (length < 1e-6) return [];
  const across = new Vector3(0, 1, 0).cross(along);
  if (across.length() < 1e-6 * length) across.set(length, 0, 0);
  const head = Math.min(0.3, 0.3 * length);
  along.setLength(head);
  across.setLength(0.5 * head);
  const side = (sign) => b.clone().sub(along).addScaledVector(across, sign).toArray();
  return [{ from, to, colour }, { from: to, to: side(1), colour }, { from: to, to: side(-1), colour }];
}

const equal = (a, b) => a === b || a.every((v, k) => v === b[k]);
const isSameCamera = (a, b) =>
  a.image === b.image && a.submap === b.submap && a.emphasis === b.emphasis && a.alpha === b.alpha && equal(a.colour, b.colour) &&
  equal(a.centre, b.centre) && equal(a.worldFromCam, b.worldFromCam) && equal(a.aspect, b.aspect);
