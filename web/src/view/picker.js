// What is under the pointer: ids instead of colours, drawn around it.
import { Color, WebGLRenderTarget } from 'three';
import * as sim from '../similarity.js';
import { pointPickMaterial } from './points.js';
import { meshPickMaterial } from './triangles.js';

const kPickPx = 13; // square around the pointer, odd

export class Picker {
  // shared: pointUniforms(); frusta: the cameras that can be picked
  constructor({ renderer, scene, camera, shared, submaps, frusta }) {
    Object.assign(this, { renderer, scene, camera, shared, submaps, frusta });
    this.material = pointPickMaterial(shared);
    this.meshMaterial = meshPickMaterial(shared);
    this.target = new WebGLRenderTarget(kPickPx, kPickPx);
  }

  // x, y, width, height, pointPx: CSS pixels. {image}, {submap, chunk, index, version, own, point, photo: the image that
  // a surface's point is of, isMesh: whether `index` is that of a mesh's vertex} or null.
  pick(x, y, { width, height, pointPx }) {
    const half = (kPickPx - 1) / 2;
    this.camera.setViewOffset(width, height, x - half, y - half, kPickPx, kPickPx);
    const ids = this.drawIds(pointPx);
    this.camera.clearViewOffset();
    return this.nearestHit(ids);
  }

  drawIds(pointPx) {
    const { renderer } = this;
    const hidden = [];
    const restore = [];
    let base = this.frusta.cameras.length + 1;
    for (const object of this.scene.children) {
      if (object.isGroup || object === this.frusta.fill) continue;
      hidden.push([object, object.visible]);
      object.visible = false;
    }
    this.bases = [];
    for (const points of this.submaps.pickable()) {
      points.pickBase = base;
      this.bases.push({ base, points });
      base += points.shown;
      restore.push([points, points.material]);
      points.material = points.isMesh ? this.meshMaterial : this.material;
    }
    const { fill } = this.frusta;
    restore.push([fill, fill.material]);
    fill.material = fill.userData.pickMaterial;
    const clear = renderer.getClearColor(new Color());
    // Points are as large as on the screen, in a picture of as many pixels as CSS has.
    const { uPixels, uSmallest, uHalfHeight } = this.shared;
    const onScreen = [uPixels.value, uSmallest.value, uHalfHeight.value];
    [uPixels.value, uSmallest.value, uHalfHeight.value] = [pointPx, 1, kPickPx / 2];
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    renderer.render(this.scene, this.camera);
    const bytes = new Uint8Array(4 * kPickPx * kPickPx);
    renderer.readRenderTargetPixels(this.target, 0, 0, kPickPx, kPickPx, bytes);
    renderer.setRenderTarget(null);
    renderer.setClearColor(clear, 1);
    [uPixels.value, uSmallest.value, uHalfHeight.value] = onScreen;
    for (const [object, visible] of hidden) object.visible = visible;
    for (const [object, material] of restore) object.material = material;
    return bytes;
  }

  // The nearest to the pointer; of equals a camera.
  nearestHit(bytes) {
    const half = (kPickPx - 1) / 2;
    let best = null;
    for (let row = 0; row < kPickPx; ++row) {
      for (let column = 0; column < kPickPx; ++column) {
        const at = 4 * (row * kPickPx + column);
        const id = bytes[at] + 256 * bytes[at + 1] + 65536 * bytes[at + 2] + 16777216 * bytes[at + 3];
        if (id === 0) continue;
        const isCamera = id <= this.frusta.cameras.length;
        const away = Math.hypot(row - half, column - half) + (isCamera ? 0 : 0.75);
        if (!best || away < best.away) best = { id, away, isCamera };
      }
    }
    if (!best) return null;
    if (best.isCamera) return { image: this.frusta.cameras[best.id - 1].image };
    const found = this.bases.find(({ base, points }) => best.id >= base && best.id < base + points.shown);
    if (!found) return null;
    const index = best.id - found.base;
    const { submap } = found.points.userData;
    const own = found.points.own(index);
    return {
      ...found.points.userData, index, version: found.points.chunk.version, own,
      point: sim.apply(this.submaps.placeOf(submap), own),
    };
  }
}
