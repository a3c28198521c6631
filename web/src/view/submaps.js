// The submaps' points: a submap is a group that moves as a whole, a chunk of its points a child.
import { Color, Group, Quaternion, Vector3 } from 'three';
import { pointOf } from '../chunk.js';
import * as sim from '../similarity.js';
import { ChunkPoints, kAll, pointMaterial } from './points.js';

const kMoveS = 1.4; // of a submap that changes its place

export class Submaps {
  // shared: pointUniforms(). on: {changed(): it is to be drawn, moved(): what stands in a submap's frame is, too}
  constructor(scene, shared, on, { reducedMotion = () => false } = {}) {
    Object.assign(this, { scene, shared, on, reducedMotion });
    this.all = new Map(); // id -> {group, material, chunks: Map, place, move, goal}
    this.visible = true;
    this.budget = 2_000_000;
    this.numPoints = 0;
    this.numPointsShown = 0;
  }

  // Made where there is none yet.
  submap(id) {
    let submap = this.all.get(id);
    if (!submap) {
      const group = new Group();
      group.matrixAutoUpdate = false;
      group.visible = this.visible;
      submap = { group, material: pointMaterial(this.shared), chunks: new Map(), place: null, move: null };
      group.userData.uRank = submap.material.uniforms.uRank;
      this.all.set(id, submap);
      this.scene.add(group);
    }
    return submap;
  }

  setChunk(id, chunkId, chunk) {
    const submap = this.submap(id);
    let points = submap.chunks.get(chunkId);
    if (!points) {
      points = new ChunkPoints(submap.material);
      submap.chunks.set(chunkId, points);
      submap.group.add(points);
    }
    points.set(chunk);
    points.userData = { submap: id, chunk: chunkId };
    this.spend();
    this.on.changed();
  }

  dropChunk(id, chunkId) {
    const submap = this.all.get(id);
    const points = submap?.chunks.get(chunkId);
    if (!points) return;
    submap.chunks.delete(chunkId);
    submap.group.remove(points);
    points.dispose();
    this.spend();
    this.on.changed();
  }

  drop(id) {
    const submap = this.all.get(id);
    if (!submap) return;
    for (const chunkId of [...submap.chunks.keys()]) this.dropChunk(id, chunkId);
    submap.material.dispose();
    this.scene.remove(submap.group);
    this.all.delete(id);
    this.on.moved();
  }

  show(visible) {
    this.visible = visible;
    for (const { group } of this.all.values()) group.visible = visible;
    this.on.changed();
  }

  setBudget(points) {
    this.budget = points;
    this.spend();
    this.on.changed();
  }

  // Each chunk shows the same share of its points.
  spend() {
    let total = 0;
    for (const { chunks } of this.all.values()) for (const { chunk } of chunks.values()) total += chunk.total;
    const share = total > this.budget ? this.budget / total : 1;
    this.numPoints = 0;
    this.numPointsShown = 0;
    for (const { chunks } of this.all.values()) {
      for (const points of chunks.values()) {
        points.showShare(share);
        this.numPoints += points.chunk.total;
        this.numPointsShown += points.shown;
      }
    }
  }

  // Of a replay: only points up to this rank; null: all.
  setRank(id, rank) {
    const { uRank } = this.submap(id).material.uniforms;
    const value = rank ?? kAll;
    if (uRank.value === value) return;
    uRank.value = value;
    this.on.changed();
  }

  // Chunks whose points have no ranks yet.
  unranked(id) {
    return [...(this.all.get(id)?.chunks.values() ?? [])].filter((points) => !points.chunk.hasRanks);
  }

  setTint(id, colour, share) {
    const { uniforms } = this.submap(id).material;
    const tint = new Color(colour).convertLinearToSRGB().toArray();
    if (uniforms.uTintShare.value === share && uniforms.uTint.value.toArray().every((v, k) => v === tint[k])) return;
    uniforms.uTint.value.set(...tint);
    uniforms.uTintShare.value = share;
    this.on.changed();
  }

  // display_from_submap. From its present place it moves there; one that is new, or far from sight, is put there.
  setPlace(id, place, { pivot = [0, 0, 0], animate = true } = {}) {
    const submap = this.submap(id);
    if (submap.goal && isSame(submap.goal, place)) return;
    submap.goal = place;
    if (!submap.place || !animate || this.reducedMotion()) {
      submap.place = place;
      submap.move = null;
      this.applyPlace(submap);
    } else {
      submap.move = { from: submap.place, to: place, pivot, f: 0 };
    }
    this.on.moved();
  }

  placeOf(id) {
    return this.all.get(id)?.place ?? null;
  }

  // Where it is, or is on its way to.
  goalOf(id) {
    return this.all.get(id)?.goal ?? null;
  }

  ids() {
    return [...this.all.keys()];
  }

  chunk(id, chunkId) {
    return this.all.get(id)?.chunks.get(chunkId)?.chunk ?? null;
  }

  isMoving(id) {
    return Boolean(this.all.get(id)?.move);
  }

  // A step of all that are on their way; whether there are any.
  move(dt) {
    let moving = false;
    for (const submap of this.all.values()) {
      const { move } = submap;
      if (!move) continue;
      move.f = Math.min(1, move.f + dt / kMoveS);
      const eased = move.f * move.f * (3 - 2 * move.f);
      submap.place = move.f === 1 ? move.to : sim.interpolate(move.from, move.to, eased, move.pivot);
      if (move.f === 1) submap.move = null;
      this.applyPlace(submap);
      moving = true;
    }
    return moving;
  }

  applyPlace({ group, place }) {
    const [w, x, y, z] = place.q;
    group.matrix.compose(new Vector3(...place.t), new Quaternion(x, y, z, w), new Vector3(place.s, place.s, place.s));
    group.matrixWorldNeedsUpdate = true;
  }

  // Up to n points of a submap, in its frame.
  samplePoints(id, n) {
    const sample = [];
    const chunks = [...(this.all.get(id)?.chunks.values() ?? [])].map((p) => p.chunk);
    const total = chunks.reduce((sum, c) => sum + c.points, 0);
    const every = Math.max(1, total / n);
    let next = 0;
    let seen = 0;
    for (const chunk of chunks) {
      for (; next < seen + chunk.points; next += every) sample.push(pointOf(chunk, Math.floor(next - seen)));
      seen += chunk.points;
    }
    return sample;
  }
}

const isSame = (a, b) =>
  Math.abs(a.s - b.s) < 1e-9 * a.s && sim.distance(a.t, b.t) < 1e-9 && a.q.every((v, i) => Math.abs(v - b.q[i]) < 1e-9);
