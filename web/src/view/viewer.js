// The scene: submaps with their points, cameras, lines and marks; drawn only when something changed.
import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, Group, Mesh, MeshBasicMaterial, PerspectiveCamera, Quaternion,
  Scene, SRGBColorSpace, TextureLoader, Vector3, WebGLRenderer, WebGLRenderTarget,
} from 'three';
import { pointOf } from '../chunk.js';
import { quantile } from '../frames.js';
import { uprightFromStored } from '../orientation.js';
import * as sim from '../similarity.js';
import { axesOf, Controls } from './controls.js';
import { Frusta, Segments } from './lines.js';
import { ChunkPoints, kAll, pointMaterial, pointPickMaterial, pointUniforms } from './points.js';

const kMoveS = 1.4; // of a submap that changes its place
const kPickPx = 13; // square around the pointer, odd

export class Viewer {
  // on: {pick(hit), hover(hit), drawn(), resized()}; a hit is {image}, {submap, chunk, index, point} or null
  constructor(canvas, on, { reducedMotion = () => false } = {}) {
    this.canvas = canvas;
    this.on = on;
    this.reducedMotion = reducedMotion;
    this.renderer = makeRenderer(canvas); // null where the browser has no WebGL: then nothing is drawn
    this.camera = new PerspectiveCamera(42, 1, 0.01, 1000);
    this.scene = new Scene();
    this.controls = new Controls(canvas, this.camera, {
      change: () => this.draw(),
      click: (x, y) => on.pick(this.pickAt(x, y)),
      focus: (x, y) => this.focusAt(x, y),
      hover: (x, y) => this.hoverAt(x, y),
      leave: () => this.hoverAt(null),
    }, { reducedMotion });
    this.shared = pointUniforms();
    this.pointPick = pointPickMaterial(this.shared);
    this.pickTarget = new WebGLRenderTarget(kPickPx, kPickPx);
    this.submaps = new Map(); // id -> {group, material, chunks: Map, place, move}
    this.frusta = new Frusta();
    this.links = new Segments({ width: 1.6 });
    this.stationFrusta = new Frusta(); // their faces are not drawn: they are not picked
    this.ways = new Segments({ width: 1.6 });
    this.measure = new Segments({ width: 2, depthTest: false });
    this.measure.renderOrder = 5;
    this.grid = new Segments({ width: 1 });
    this.grid.renderOrder = -1;
    this.scene.add(this.grid, this.frusta.lines, this.frusta.fill, this.links, this.stationFrusta.lines, this.ways, this.measure);
    this.pictures = new Map(); // role -> {image, mesh}
    this.cameras = []; // as set, with places in the submaps' frames
    this.stations = []; // the same
    this.pointPx = 0; // 0: by how many there are
    this.cameraScale = 1;
    this.cameraBase = 0.42;
    this.budget = 2_000_000;
    this.framesDrawn = 0;
    this.loader = new TextureLoader();
    canvas.addEventListener('webglcontextlost', (e) => e.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => this.draw());
    document.addEventListener('visibilitychange', () => this.draw());
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas.parentElement);
    this.resize();
  }

  // ---- drawing

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer?.setPixelRatio(ratio);
    this.renderer?.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.size = { width, height, ratio };
    for (const lines of [this.frusta, this.stationFrusta, this.ways, this.links, this.measure, this.grid]) lines.resize(width, height, ratio);
    this.on.resized();
    this.draw();
  }

  // Asks for one frame. A hidden page draws nothing, and draws when it is seen again.
  draw() {
    if (this.pending || document.hidden) return;
    this.pending = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  frame(now) {
    this.pending = false;
    if (!this.size) return;
    const dt = Math.min((now - (this.last ?? now)) / 1000, 0.1) || 1 / 60;
    this.last = now;
    const onItsWay = this.controls.update(dt);
    const moving = this.moveSubmaps(dt);
    if (moving || this.camerasChanged) this.placeCameras();
    this.shared.uReference.value = this.controls.now.distance;
    this.shared.uPixels.value = this.autoPointPx * this.size.ratio;
    this.shared.uSmallest.value = this.size.ratio;
    for (const { uniforms } of [this.frusta, this.stationFrusta]) uniforms.uScale.value = this.cameraScale;
    this.renderer?.render(this.scene, this.camera);
    this.framesDrawn++;
    this.on.drawn();
    if (onItsWay || moving) this.draw();
    else this.last = null;
  }

  setPaper(colour, gridColour) {
    this.renderer?.setClearColor(new Color(colour), 1);
    this.shared.uPaper.value.set(colour).convertLinearToSRGB();
    this.gridColour = gridColour;
    this.layGrid();
    this.draw();
  }

  // A floor at y = 0, one square a step between photos.
  layGrid() {
    const segments = [];
    const n = Math.min(Math.ceil(this.gridReach ?? 8), 40);
    const [r, g, b] = new Color(this.gridColour ?? '#888').convertLinearToSRGB().toArray();
    for (let i = -n; i <= n; ++i) {
      const reach = Math.sqrt(Math.max(n * n - i * i, 0));
      const colour = [r, g, b, i % 5 === 0 ? 0.5 : 0.22];
      segments.push({ from: [i, 0, -reach], to: [i, 0, reach], colour }, { from: [-reach, 0, i], to: [reach, 0, i], colour });
    }
    this.grid.set(segments);
  }

  setGridReach(reach) {
    const rounded = 5 * Math.ceil(reach / 5);
    if (rounded === this.gridReach) return;
    this.gridReach = rounded;
    this.layGrid();
    this.draw();
  }

  setFaded(share) {
    if (share === this.shared.uFaded.value) return;
    this.shared.uFaded.value = share;
    this.draw();
  }

  setPointPx(px) {
    this.pointPx = px;
    this.draw();
  }

  setCameraScale(scale) {
    this.cameraScale = scale;
    this.camerasChanged = true;
    this.draw();
  }

  show(what, visible) {
    if (what === 'points') for (const { group } of this.submaps.values()) group.visible = visible;
    if (what === 'cameras') this.hideCameras = !visible;
    if (what === 'grid') this.grid.visible = visible;
    this.hidePoints = what === 'points' ? !visible : this.hidePoints;
    this.camerasChanged = true;
    this.draw();
  }

  // ---- submaps and points

  submap(id) {
    let submap = this.submaps.get(id);
    if (!submap) {
      const group = new Group();
      group.matrixAutoUpdate = false;
      group.visible = !this.hidePoints;
      submap = { group, material: pointMaterial(this.shared), chunks: new Map(), place: null, move: null };
      group.userData.uRank = submap.material.uniforms.uRank;
      this.submaps.set(id, submap);
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
    this.draw();
  }

  dropChunk(id, chunkId) {
    const submap = this.submaps.get(id);
    const points = submap?.chunks.get(chunkId);
    if (!points) return;
    submap.chunks.delete(chunkId);
    submap.group.remove(points);
    points.dispose();
    this.spend();
    this.draw();
  }

  dropSubmap(id) {
    const submap = this.submaps.get(id);
    if (!submap) return;
    for (const chunkId of [...submap.chunks.keys()]) this.dropChunk(id, chunkId);
    submap.material.dispose();
    this.scene.remove(submap.group);
    this.submaps.delete(id);
    this.camerasChanged = true;
    this.draw();
  }

  setBudget(points) {
    this.budget = points;
    this.spend();
    this.draw();
  }

  // Each chunk shows the same share of its points.
  spend() {
    let total = 0;
    for (const { chunks } of this.submaps.values()) for (const { chunk } of chunks.values()) total += chunk.total;
    const share = total > this.budget ? this.budget / total : 1;
    this.numPoints = 0;
    this.numPointsShown = 0;
    for (const { chunks } of this.submaps.values()) {
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
    this.draw();
  }

  // Chunks whose points have no ranks yet.
  unranked(id) {
    return [...(this.submaps.get(id)?.chunks.values() ?? [])].filter((points) => !points.chunk.hasRanks);
  }

  setTint(id, colour, share) {
    const { uniforms } = this.submap(id).material;
    const tint = new Color(colour).convertLinearToSRGB().toArray();
    if (uniforms.uTintShare.value === share && uniforms.uTint.value.toArray().every((v, k) => v === tint[k])) return;
    uniforms.uTint.value.set(...tint);
    uniforms.uTintShare.value = share;
    this.draw();
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
    this.camerasChanged = true;
    this.draw();
  }

  placeOf(id) {
    return this.submaps.get(id)?.place ?? null;
  }

  isMoving(id) {
    return Boolean(this.submaps.get(id)?.move);
  }

  moveSubmaps(dt) {
    let moving = false;
    for (const submap of this.submaps.values()) {
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
    const chunks = [...(this.submaps.get(id)?.chunks.values() ?? [])].map((p) => p.chunk);
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

  // ---- cameras

  // [{image, submap, centre, worldFromCam: in the submap's frame, aspect: tan of half the angles, colour: [r, g, b],
  // alpha, emphasis}]
  setCameras(cameras) {
    if (cameras.length === this.cameras.length && cameras.every((c, i) => isSameCamera(c, this.cameras[i]))) return;
    this.cameras = cameras;
    this.camerasChanged = true;
    this.draw();
  }

  placeCameras() {
    this.camerasChanged = false;
    this.placed = new Map();
    const shown = [];
    for (const camera of this.cameras) {
      const place = this.placeOf(camera.submap);
      if (!place) continue;
      const depth = this.cameraBase * (camera.emphasis ? 1.45 : 1);
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
    this.frusta.set(this.hideCameras ? [] : shown);
    this.placeStations();
    this.placeLinks();
    for (const picture of this.pictures.values()) this.placePicture(picture);
  }

  // Photos to take: as cameras, and `from` the image that an arrow leads from.
  setStations(stations) {
    if (JSON.stringify(stations) === JSON.stringify(this.stations)) return;
    this.stations = stations;
    this.camerasChanged = true;
    this.draw();
  }

  placeStations() {
    const shown = [];
    const arrows = [];
    const depth = 1.2 * this.cameraBase;
    for (const station of this.stations) {
      const place = this.placeOf(station.submap);
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
    if (JSON.stringify(links) === JSON.stringify(this.wantedLinks ?? [])) return;
    this.wantedLinks = links;
    this.placeLinks();
    this.draw();
  }

  placeLinks() {
    const segments = [];
    for (const { from, to, colour } of this.wantedLinks ?? []) {
      const a = this.placed?.get(from);
      const b = this.placed?.get(to);
      if (a && b) segments.push({ from: a.centre, to: b.centre, colour });
    }
    this.links.set(segments);
  }

  // The photo on its camera's image plane. `role`: one picture each ("newest", "selected").
  setPicture(role, image, url, orientation = 1) {
    const old = this.pictures.get(role);
    if (old?.image === image) return;
    if (old) {
      this.scene.remove(old.mesh);
      old.mesh.geometry.dispose();
      old.mesh.material.map?.dispose();
      old.mesh.material.dispose();
      this.pictures.delete(role);
    }
    this.draw();
    if (!image) return;
    const geometry = new BufferGeometry();
    const corners = [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]];
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(corners.flat()), 3));
    const uv = corners.flatMap(([x, y]) => {
      const [u, v] = uprightFromStored(orientation, (x + 1) / 2, (y + 1) / 2);
      return [u, 1 - v];
    });
    geometry.setAttribute('uv', new BufferAttribute(new Float32Array(uv), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const material = new MeshBasicMaterial({ side: DoubleSide, toneMapped: false, transparent: true, opacity: 0.95 });
    const mesh = new Mesh(geometry, material);
    mesh.visible = false;
    mesh.matrixAutoUpdate = false;
    mesh.frustumCulled = false;
    mesh.renderOrder = 3;
    const picture = { image, mesh, ready: false };
    this.pictures.set(role, picture);
    this.scene.add(mesh);
    this.loader.load(url, (texture) => {
      if (this.pictures.get(role) !== picture) {
        texture.dispose();
        return;
      }
      texture.colorSpace = SRGBColorSpace;
      material.map = texture;
      material.needsUpdate = true;
      picture.ready = true;
      this.placePicture(picture);
      this.draw();
    }, undefined, () => {});
  }

  placePicture({ image, mesh, ready }) {
    const camera = this.placed?.get(image);
    mesh.visible = ready && Boolean(camera) && !this.hideCameras;
    if (!camera) return;
    const [w, x, y, z] = camera.q;
    const [sx, sy, sz] = camera.size.map((v) => v * this.cameraScale);
    mesh.matrix.compose(new Vector3(...camera.centre), new Quaternion(x, y, z, w), new Vector3(sx, sy, sz));
    mesh.matrixWorldNeedsUpdate = true;
  }

  // Marks and the line of a measurement: points of the display's frame.
  setMeasure(points, colour) {
    const segments = [];
    const rgb = new Color(colour).convertLinearToSRGB().toArray();
    const arm = 0.02 * this.controls.now.distance;
    for (const p of points) {
      for (let k = 0; k < 3; ++k) {
        const to = [...p];
        const from = [...p];
        to[k] += arm;
        from[k] -= arm;
        segments.push({ from, to, colour: [...rgb, 1] });
      }
    }
    if (points.length === 2) segments.push({ from: points[0], to: points[1], colour: [...rgb, 1] });
    const key = JSON.stringify(segments);
    if (key === this.measureKey) return;
    this.measureKey = key;
    this.measure.set(segments);
    this.draw();
  }

  // ---- looking

  // CSS pixels of a point of the display's frame; null where it is behind the eye.
  project(point) {
    const p = new Vector3(...point).project(this.camera);
    if (p.z > 1 || p.z < -1) return null;
    const { width, height } = this.size;
    return { x: ((p.x + 1) / 2) * width, y: ((1 - p.y) / 2) * height };
  }

  // Where the middle of a camera's frustum is seen.
  projectCamera(image) {
    const camera = this.placed?.get(image);
    if (!camera) return null;
    const depth = camera.size[2] * this.cameraScale;
    return this.project(sim.add(camera.centre, sim.rotate(camera.q, [0, 0, 0.6 * depth])));
  }

  // All that is worth seeing, in the display's frame.
  extent() {
    const all = [];
    for (const [id, { goal }] of this.submaps) {
      if (!goal) continue;
      for (const p of this.samplePoints(id, 1500)) all.push(sim.apply(goal, p));
    }
    const cameras = [];
    for (const { submap, centre } of this.cameras) {
      const goal = this.submaps.get(submap)?.goal;
      if (goal) cameras.push(sim.apply(goal, centre));
    }
    return { points: all, cameras };
  }

  // From as near as possible so that nearly all of it is seen.
  fit({ keepDirection = true } = {}) {
    const { points, cameras } = this.extent();
    if (points.length + cameras.length === 0) return false;
    const { controls } = this;
    const direction = keepDirection ? { yaw: controls.goal.yaw, pitch: controls.goal.pitch } : this.bestDirection();
    const all = points.concat(cameras);
    const middle = [0, 1, 2].map((k) => {
      const [of, along] = [cameras.map((p) => p[k]), points.map((p) => p[k])];
      const low = Math.min(...(along.length ? [quantile(along, 0.04)] : []), ...(of.length ? [quantile(of, 0.02)] : []));
      const high = Math.max(...(along.length ? [quantile(along, 0.96)] : []), ...(of.length ? [quantile(of, 0.98)] : []));
      return (low + high) / 2;
    });
    const { right, up, forward } = axesOf({ ...direction, distance: 1 });
    const tanY = Math.tan((this.camera.fov * Math.PI) / 360) * 0.92;
    const tanX = tanY * this.camera.aspect;
        const needed = (p) => {
      const v = sim.subtract(p, middle);
      const along = (axis) => sim.dot(v, [axis.x, axis.y, axis.z]);
      return Math.max(Math.abs(along(right)) / tanX, Math.abs(along(up)) / tanY) - along(forward);
    };
    const distance = Math.max(quantile(points.map(needed), 0.95), quantile(cameras.map(needed), 0.99) + this.cameraBase, 2);
    controls.goTo({ target: middle, distance: Math.min(distance, 4000), ...direction });
    this.setGridReach(1.1 * quantile(all.map((p) => sim.distance(p, middle)), 0.97) + 3);
    return true;
  }

  // As the cameras look, a little from the side and from above; photos of an object all around have no such direction.
  bestDirection() {
    let mean = [0, 0, 0];
    for (const { submap, worldFromCam } of this.cameras) {
      const goal = this.submaps.get(submap)?.goal;
      if (goal) mean = sim.add(mean, sim.scaled(sim.rotate(sim.multiply(goal.q, worldFromCam), [0, 0, 1]), 1 / this.cameras.length));
    }
    const level = Math.hypot(mean[0], mean[2]);
    const pitch = mean[1] < -0.6 ? 0.95 : 0.45;
    // Maps stand side by side along x.
    if (new Set(this.cameras.map((c) => c.submap)).size > 1) return { yaw: 0.15, pitch };
    return { yaw: level > 0.25 ? Math.atan2(-mean[0], -mean[2]) + 0.4 : 0.6, pitch };
  }

  // Cameras are as large as a step between photos, and large enough to be seen in the whole.
  setCameraBase(base) {
    if (Math.abs(base - this.cameraBase) < 0.1 * base) return;
    this.cameraBase = base;
    this.camerasChanged = true;
    this.draw();
  }

  // Points that touch each other where the picture is full of them.
  get autoPointPx() {
    if (this.pointPx) return this.pointPx;
    const perPoint = (this.size.width * this.size.height) / Math.max(this.numPointsShown ?? 1, 1);
    return Math.min(4, Math.max(2, 0.8 * Math.sqrt(perPoint)));
  }

  // From behind and above a camera, along its view.
  followCamera(image) {
    const camera = this.placed?.get(image);
    if (!camera) return false;
    const forward = sim.rotate(camera.q, [0, 0, 1]);
    const away = sim.add(sim.scaled(forward, -4.5), [0, 2.2, 0]);
    this.controls.goTo({
      target: sim.add(camera.centre, sim.scaled(forward, 1.5)),
      eye: sim.add(camera.centre, away),
    });
    return true;
  }

  // Puts the camera in the middle without turning.
  lookAtCamera(image) {
    const camera = this.placed?.get(image);
    if (!camera) return false;
    this.controls.goTo({ target: camera.centre, distance: Math.min(this.controls.goal.distance, 12) });
    return true;
  }

  focusAt(x, y) {
    const hit = this.pickAt(x, y);
    if (hit?.point) {
      this.controls.goTo({ target: hit.point, distance: Math.max(0.6 * this.controls.goal.distance, 0.5) });
    } else if (hit?.image) {
      this.lookAtCamera(hit.image);
    }
  }

  // ---- picking: ids instead of colours, drawn around the pointer

  pickAt(x, y) {
    if (!this.renderer || !this.size || x < 0 || y < 0 || x > this.size.width || y > this.size.height) return null;
    if (this.camerasChanged) this.placeCameras();
    const { width, height } = this.size;
    const half = (kPickPx - 1) / 2;
    this.camera.setViewOffset(width, height, x - half, y - half, kPickPx, kPickPx);
    const ids = this.drawIds(this.renderer);
    this.camera.clearViewOffset();
    return this.nearestHit(ids);
  }

  drawIds(renderer) {
    const hidden = [];
    const restore = [];
    let base = this.frusta.cameras.length + 1;
    for (const object of [this.grid, this.links, this.ways, this.stationFrusta.lines, this.measure, this.frusta.lines, ...[...this.pictures.values()].map((p) => p.mesh)]) {
      hidden.push([object, object.visible]);
      object.visible = false;
    }
    this.bases = [];
    for (const { chunks } of this.submaps.values()) {
      for (const points of chunks.values()) {
        const own = base;
        this.bases.push({ base, points });
        base += points.shown;
        restore.push([points, points.material]);
        points.material = this.pointPick;
        points.onBeforeRender = () => {
          this.pointPick.uniforms.uBase.value = own;
          this.pointPick.uniforms.uRank.value = points.parent.userData.uRank.value;
          this.pointPick.uniformsNeedUpdate = true;
        };
      }
    }
    const { fill } = this.frusta;
    restore.push([fill, fill.material]);
    fill.material = fill.userData.pickMaterial;
    const clear = renderer.getClearColor(new Color());
    // Points are as large as on the screen, in a picture of as many pixels as CSS has.
    const { uPixels, uSmallest } = this.shared;
    [uPixels.value, uSmallest.value] = [this.autoPointPx, 1];
    renderer.setRenderTarget(this.pickTarget);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    renderer.render(this.scene, this.camera);
    const bytes = new Uint8Array(4 * kPickPx * kPickPx);
    renderer.readRenderTargetPixels(this.pickTarget, 0, 0, kPickPx, kPickPx, bytes);
    renderer.setRenderTarget(null);
    renderer.setClearColor(clear, 1);
    [uPixels.value, uSmallest.value] = [this.autoPointPx * this.size.ratio, this.size.ratio];
    for (const [object, visible] of hidden) object.visible = visible;
    for (const [object, material] of restore) {
      object.material = material;
      object.onBeforeRender = () => {};
    }
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
    const { submap, chunk } = found.points.userData;
    const own = pointOf(found.points.chunk, index);
    return {
      submap, chunk, index, version: found.points.chunk.version, own,
      point: sim.apply(this.placeOf(submap), own),
    };
  }

  hoverAt(x, y) {
    if (x === null) {
      this.on.hover(null, 0, 0);
      return;
    }
    this.hovering = { x, y };
    if (this.hoverPending) return;
    this.hoverPending = true;
    setTimeout(() => {
      this.hoverPending = false;
      if (this.controls.pointers.size > 0 || document.hidden) return;
      this.on.hover(this.pickAt(this.hovering.x, this.hovering.y), this.hovering.x, this.hovering.y);
    }, 60);
  }

  // For tests: how many different colours a coarse sample of the picture has, and the share that is not paper.
  samplePixels() {
    this.renderer.render(this.scene, this.camera);
    const gl = this.renderer.getContext();
    const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const bytes = new Uint8Array(4 * w * h);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const colours = new Map();
    let n = 0;
    for (let at = 0; at < bytes.length; at += 4 * 7) {
      const key = (bytes[at] << 16) | (bytes[at + 1] << 8) | bytes[at + 2];
      colours.set(key, (colours.get(key) ?? 0) + 1);
      n++;
    }
    return { colours: colours.size, painted: 1 - Math.max(...colours.values()) / n };
  }
}

function makeRenderer(canvas) {
  try {
    return new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
  } catch {
    return null;
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

const isSame = (a, b) =>
  Math.abs(a.s - b.s) < 1e-9 * a.s && sim.distance(a.t, b.t) < 1e-9 && a.q.every((v, i) => Math.abs(v - b.q[i]) < 1e-9);

