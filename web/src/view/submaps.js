// The submaps' points: a submap is a group that moves as a whole, a chunk of its points a child. Its surface is chunks as
// well, each at the place of its photo, and so is its mesh, of triangles. One of the three is shown.
import { Color, Group } from 'three';
import { pointOf, shareWithin } from '../chunk.js';
import { visitInside } from '../section.js';
import * as sim from '../similarity.js';
import { ChunkPoints, kAll, matrixOf, pointMaterial, setSection, tintUniforms } from './points.js';
import { ChunkMesh, meshMaterial } from './triangles.js';

const kMoveS = 1.4; // of a submap that changes its place

export class Submaps {
  // shared: pointUniforms(). on: {changed(): it is to be drawn, moved(): what stands in a submap's frame is, too}
  constructor(scene, shared, on, { reducedMotion = () => false } = {}) {
    Object.assign(this, { scene, shared, on, reducedMotion });
    this.all = new Map(); // id -> {group, material, meshMaterial, tint, rank, chunks: Map, surface: Map, mesh: Map, photos: Map, place, move, goal}
    this.visible = true;
    this.section = null; // {low, high} of the display's frame: points outside are hidden
    this.showsSurfaces = false;
    this.showsMeshes = false;
    this.budget = 2_000_000;
    this.changes = 0; // of points and of their places in their submaps
    this.numPoints = 0; // of chunks, whether shown or not
    this.numPointsShown = 0;
    this.numSurfacePoints = 0; // the same
    this.numSurfacePointsShown = 0;
    this.numTriangles = 0; // of meshes, whether shown or not
    this.numTrianglesShown = 0;
  }

  // Made where there is none yet.
  submap(id) {
    let submap = this.all.get(id);
    if (!submap) {
      const group = new Group();
      group.matrixAutoUpdate = false;
      group.visible = this.visible;
      const tint = tintUniforms();
      const material = pointMaterial({ ...this.shared, ...tint });
      submap = {
        group, material, meshMaterial: meshMaterial({ ...this.shared, ...tint }), tint, rank: kAll,
        chunks: new Map(), surface: new Map(), mesh: new Map(), photos: new Map(), place: null, move: null,
      };
      this.all.set(id, submap);
      this.scene.add(group);
    }
    return submap;
  }

  setChunk(id, chunkId, chunk) {
    const submap = this.submap(id);
    const points = chunkIn(submap, submap.chunks, chunkId);
    points.set(chunk);
    points.rank = submap.rank;
    points.userData = { submap: id, chunk: chunkId };
    this.changed();
  }

  // Of the depth map of `image`; it is shown where setPhotos() gave that photo a place.
  setSurfaceChunk(id, chunkId, chunk, image) {
    const submap = this.submap(id);
    const points = chunkIn(submap, submap.surface, chunkId);
    points.set(chunk);
    points.userData = { submap: id, chunk: chunkId, photo: image };
    placeAt(points, submap.photos.get(image));
    this.changed();
  }

  // photos: of photoPlaces()
  setPhotos(id, photos) {
    const submap = this.submap(id);
    submap.photos = photos;
    for (const points of submap.surface.values()) placeAt(points, photos.get(points.userData.photo));
    this.changed();
  }

  // frame: photos with their poses in the frame that the chunk was made in. place: submap_from_frame
  setMeshChunk(id, chunkId, chunk, frame, place) {
    const submap = this.submap(id);
    const triangles = chunkIn(submap, submap.mesh, chunkId, () => new ChunkMesh(submap.meshMaterial));
    triangles.set(chunk);
    triangles.setPlace(place);
    triangles.frame = frame;
    triangles.userData = { submap: id, chunk: chunkId, isMesh: true };
    this.changed();
  }

  // placeOf(frame): submap_from_frame
  placeMesh(id, placeOf) {
    const mesh = this.all.get(id)?.mesh;
    if (!mesh?.size) return;
    const places = new Map(); // of each frame
    for (const triangles of mesh.values()) {
      const { frame } = triangles;
      if (!places.has(frame)) places.set(frame, placeOf(frame));
      triangles.setPlace(places.get(frame));
    }
    this.changed();
  }

  cutMeshChunk(id, chunkId, count) {
    this.all.get(id)?.mesh.get(chunkId)?.cut(count);
    this.changed();
  }

  dropMeshChunk(id, chunkId) {
    const submap = this.all.get(id);
    if (submap) this.remove(submap, submap.mesh, chunkId);
  }

  dropMesh(id) {
    for (const chunkId of [...(this.all.get(id)?.mesh.keys() ?? [])]) this.dropMeshChunk(id, chunkId);
  }

  // Keeps the first `points` of a chunk.
  cutChunk(id, chunkId, points) {
    this.all.get(id)?.chunks.get(chunkId)?.cut(points);
    this.changed();
  }

  cutSurfaceChunk(id, chunkId, points) {
    this.all.get(id)?.surface.get(chunkId)?.cut(points);
    this.changed();
  }

  dropChunk(id, chunkId) {
    const submap = this.all.get(id);
    if (submap) this.remove(submap, submap.chunks, chunkId);
  }

  dropSurfaceChunk(id, chunkId) {
    const submap = this.all.get(id);
    if (submap) this.remove(submap, submap.surface, chunkId);
  }

  remove(submap, chunks, chunkId) {
    const points = chunks.get(chunkId);
    if (!points) return;
    chunks.delete(chunkId);
    submap.group.remove(points);
    points.dispose();
    this.changed();
  }

  dropSurface(id) {
    const submap = this.all.get(id);
    if (!submap) return;
    for (const chunkId of [...submap.surface.keys()]) this.remove(submap, submap.surface, chunkId);
    submap.photos = new Map();
  }

  drop(id) {
    const submap = this.all.get(id);
    if (!submap) return;
    for (const chunkId of [...submap.chunks.keys()]) this.dropChunk(id, chunkId);
    this.dropSurface(id);
    this.dropMesh(id);
    submap.material.dispose();
    submap.meshMaterial.dispose();
    this.scene.remove(submap.group);
    this.all.delete(id);
    this.on.moved();
  }

  show(visible) {
    this.visible = visible;
    for (const { group } of this.all.values()) group.visible = visible;
    this.on.changed();
  }

  // Surfaces instead of points, of submaps that have one.
  showSurfaces(on) {
    if (on === this.showsSurfaces) return;
    this.showsSurfaces = on;
    this.changed();
  }

  // Meshes instead of points, of submaps that have one.
  showMeshes(on) {
    if (on === this.showsMeshes) return;
    this.showsMeshes = on;
    this.changed();
  }

  // Whether its surface or its mesh is shown.
  showsSurface(id) {
    return this.showsMesh(id) || (this.showsSurfaces && this.all.get(id)?.surface.size > 0);
  }

  showsMesh(id) {
    return this.showsMeshes && this.all.get(id)?.mesh.size > 0;
  }

  // null: none.
  setSection(box) {
    if (JSON.stringify(box) === JSON.stringify(this.section)) return;
    this.section = box;
    setSection(this.shared, box);
    this.changed();
  }

  setBudget(points) {
    this.budget = points;
    this.changed();
  }

  changed() {
    this.changes++;
    this.spend();
    this.on.changed();
  }

  // Each chunk that is drawn shows the same share of its points.
  spend() {
    let total = 0;
    for (const [id, { chunks, surface, mesh }] of this.all) {
      const isMesh = this.showsMesh(id);
      const isSurface = this.showsSurface(id) && !isMesh;
      for (const points of chunks.values()) points.visible = !isSurface && !isMesh;
      for (const points of surface.values()) points.visible = isSurface && points.isPlaced;
      for (const triangles of mesh.values()) triangles.visible = isMesh;
    }
    for (const { chunk } of this.drawn()) total += chunk.total;
    const share = shareWithin(this.budget, total);
    Object.assign(this, { numPoints: 0, numPointsShown: 0, numSurfacePoints: 0, numSurfacePointsShown: 0, numTriangles: 0, numTrianglesShown: 0 });
    for (const { chunks, surface, mesh } of this.all.values()) {
      for (const { chunk, visible } of mesh.values()) {
        this.numTriangles += chunk.triangles;
        if (visible) this.numTrianglesShown += chunk.triangles;
      }
      for (const points of chunks.values()) {
        points.showShare(share);
        this.numPoints += points.chunk.total;
        if (points.visible) this.numPointsShown += points.shown;
      }
      for (const points of surface.values()) {
        points.showShare(share);
        this.numSurfacePoints += points.chunk.total;
        if (points.visible) this.numSurfacePointsShown += points.shown;
      }
    }
  }

  // The chunks of points, and of triangles, that are drawn while points are.
  * pickable() {
    yield* this.drawn();
    for (const { mesh } of this.all.values()) for (const triangles of mesh.values()) if (triangles.visible) yield triangles;
  }

  * drawn() {
    for (const { chunks, surface } of this.all.values()) {
      for (const points of chunks.values()) if (points.visible) yield points;
      for (const points of surface.values()) if (points.visible) yield points;
    }
  }

  // Of a replay: only points up to this rank; null: all.
  setRank(id, rank) {
    const submap = this.submap(id);
    const value = rank ?? kAll;
    if (submap.rank === value) return;
    submap.rank = value;
    for (const points of submap.chunks.values()) points.rank = value;
    this.on.changed();
  }

  // Chunks whose points have no ranks yet.
  unranked(id) {
    return [...(this.all.get(id)?.chunks.values() ?? [])].filter((points) => !points.chunk.hasRanks);
  }

  setTint(id, colour, share) {
    const { tint: uniforms } = this.submap(id);
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

  // Of a point that was picked: where it is in its submap's frame now; null where its chunk is another one.
  ownOf({ submap, chunk, index, version, photo, isMesh }) {
    const of = this.all.get(submap);
    const points = (isMesh ? of?.mesh : photo ? of?.surface : of?.chunks)?.get(chunk);
    if (points?.chunk.version !== version || index >= points.numPoints) return null;
    return points.own(index);
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
    group.matrix.copy(matrixOf(place));
    group.matrixWorldNeedsUpdate = true;
  }

  // visit(x, y, z) of a submap's surface, the vertices of its mesh or its points, those of the three that are shown, in its
  // frame: all that were loaded and that the section shows.
  eachPoint(id, visit) {
    const { chunks, surface, mesh, place } = this.all.get(id) ?? { chunks: new Map(), surface: new Map(), mesh: new Map() };
    const visitor = this.section && place ? visitInside(this.section, place, visit) : visit;
    for (const points of [...chunks.values(), ...surface.values(), ...mesh.values()]) if (points.visible) points.each(visitor);
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

// Made where there is none yet.
function chunkIn({ material, group }, chunks, chunkId, make = () => new ChunkPoints(material)) {
  let points = chunks.get(chunkId);
  if (!points) {
    points = make();
    chunks.set(chunkId, points);
    group.add(points);
  }
  return points;
}

function placeAt(points, at) {
  points.isPlaced = Boolean(at);
  if (at) points.setPlace(at);
}

const isSame = (a, b) =>
  Math.abs(a.s - b.s) < 1e-9 * a.s && sim.distance(a.t, b.t) < 1e-9 && a.q.every((v, i) => Math.abs(v - b.q[i]) < 1e-9);
