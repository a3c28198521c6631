// What is written over the picture: names of maps, of what is hovered or selected, a measurement, and the scale.
import { liveSubmaps, photoName } from '../fold.js';
import * as sim from '../similarity.js';
import { length, plural } from '../words.js';
import { byId, h, keyed, setText } from './dom.js';

const kScalePx = 110;

export class Labels {
  constructor({ viewer, world, measure }) {
    Object.assign(this, { viewer, world, measure });
    this.labels = [];
  }

  update({ state, timeline, selection }, hovered) {
    const labels = [];
    const live = liveSubmaps(timeline.live).filter((s) => this.world.measures.has(s.id));
    for (const { id, numRegistered } of live.length > 1 ? live : []) {
      labels.push({ key: `m${id}`, className: 'map_label', text: `Map ${id} · ${plural(numRegistered, 'photo')}`, map: id });
    }
    for (const [key, image] of [['hover', hovered], ['selected', selection?.image]]) {
      const photo = state.photos.get(image);
      if (!photo || (key === 'hover' && image === selection?.image)) continue;
      labels.push({ key, className: `photo_label ${key}`, text: photoName(photo.agent, photo.name), image });
    }
    if (selection?.point) labels.push({ key: 'point', className: 'point_mark', text: '', point: this.pointNow(selection) });
    const measured = this.measure.label();
    if (measured) labels.push({ key: 'measure', className: 'measure_label', ...measured });
    this.labels = labels;
    keyed(byId('labels'), labels, (l) => l.key, () => h('span'), (element, l) => {
      element.className = l.className;
      setText(element, l.text);
    });
    this.place();
  }

  // A point stays with its submap.
  pointNow(selection) {
    const place = this.viewer.submaps.placeOf(selection.submap);
    const own = this.viewer.submaps.ownOf(selection);
    return place && own ? sim.apply(place, own) : selection.point;
  }

  // After each frame.
  place() {
    const elements = byId('labels').children;
    this.labels.forEach((label, i) => {
      const at = this.whereIs(label);
      elements[i].hidden = !at;
      if (!at) return;
      const x = label.key === 'measure' ? this.within(at.x, elements[i].offsetWidth) : at.x;
      elements[i].style.transform = `translate(${Math.round(x)}px, ${Math.round(at.y)}px)`;
    });
    this.placeScale();
    this.placeNorth();
  }

  // North is -z in the display: straight up on the screen where the view's yaw is 0.
  placeNorth() {
    byId('north').hidden = !this.world.knowsNorth();
    byId('needle').style.transform = `rotate(${this.viewer.controls.now.yaw}rad)`;
  }

  // The middle of a label of that width that is wholly seen.
  within(x, width) {
    const { width: stage } = this.viewer.size;
    const half = width / 2 + 6;
    return half > stage / 2 ? stage / 2 : Math.max(half, Math.min(stage - half, x));
  }

  whereIs({ image, map, point }) {
    if (image) return this.viewer.projectCamera(image);
    return map ? this.mapTop(map) : this.viewer.project(point);
  }

  mapTop(id) {
    const place = this.viewer.submaps.placeOf(id);
    const measure = this.world.measures.get(id)?.measure;
    if (!place || !measure) return null;
    const [x, y, z] = sim.apply(place, measure.middle);
    return this.viewer.project([x, y + 0.75 * measure.reach * place.s, z]);
  }

  // A bar of a round length at the distance of what is looked at.
  placeScale() {
    const { camera, controls, size } = this.viewer;
    byId('scale').hidden = !size || this.world.measures.size === 0;
    if (byId('scale').hidden) return;
    const metres = this.measure.displayMetres();
    const perPx = ((2 * controls.now.distance * Math.tan((camera.fov * Math.PI) / 360)) / size.height) * (metres ?? 1);
    const power = 10 ** Math.floor(Math.log10(kScalePx * perPx));
    const round = [5, 2, 1].map((f) => f * power).find((v) => v <= kScalePx * perPx) ?? power;
    byId('scale_bar').style.width = `${Math.round(round / perPx)}px`;
    setText(byId('scale_text'), length(round, metres !== undefined));
  }
}
