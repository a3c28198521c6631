// The scene: submaps with their points, cameras, lines and marks; drawn only when something changed.
import { Color, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from 'three';
import { boxEdges } from '../section.js';
import * as sim from '../similarity.js';
import { Cameras } from './cameras.js';
import { axesOf, Controls } from './controls.js';
import { bestDirection, framing } from './framing.js';
import { Segments } from './lines.js';
import { Picker } from './picker.js';
import { pointUniforms } from './points.js';
import { Submaps } from './submaps.js';

export class Viewer {
  // on: {pick(hit), hover(hit), drawn(), resized()}; a hit is {image}, {submap, chunk, index, point, photo?} or null
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
    this.submaps = new Submaps(this.scene, this.shared, { changed: () => this.draw(), moved: () => this.cameras.change() }, { reducedMotion });
    this.cameras = new Cameras(this.scene, this.submaps, () => this.draw());
    this.measure = new Segments({ width: 2, depthTest: false });
    this.measure.renderOrder = 5;
    this.grid = new Segments({ width: 1 });
    this.grid.renderOrder = -1;
    this.section = new Segments({ width: 1.5 });
    this.scene.add(this.grid, this.measure, this.section);
    const { renderer, scene, camera, shared, submaps } = this;
    this.picker = renderer && new Picker({ renderer, scene, camera, shared, submaps, frusta: this.cameras.frusta });
    this.sectionKey = null;
    this.pointPx = 0; // 0: by how many there are
    this.framesDrawn = 0;
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
    for (const lines of [this.cameras, this.measure, this.grid, this.section]) lines.resize(width, height, ratio);
    this.on.resized();
    this.draw();
  }

  // Asks for one frame. A hidden page draws nothing, and draws when it is seen again.
  draw() {
    if (this.pending || document.hidden) return;
    this.pending = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  // Whether neither a frame nor a look at what is under the pointer is to come.
  get atRest() {
    return !this.pending && !this.hoverPending;
  }

  frame(now) {
    this.pending = false;
    if (!this.size) return;
    const dt = Math.min((now - (this.last ?? now)) / 1000, 0.1) || 1 / 60;
    this.last = now;
    const onItsWay = this.controls.update(dt);
    const moving = this.submaps.move(dt);
    if (moving || this.cameras.stale) this.cameras.place();
    this.shared.uReference.value = this.controls.now.distance;
    this.shared.uPixels.value = this.autoPointPx * this.size.ratio;
    this.shared.uSmallest.value = this.size.ratio;
    this.shared.uHalfHeight.value = (this.size.height * this.size.ratio) / 2;
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

  // Dense points in the colour of their confidence.
  showConfidence(on) {
    if (on === this.shared.uShowsConfidence.value) return;
    this.shared.uShowsConfidence.value = on;
    this.draw();
  }

  setPointPx(px) {
    this.pointPx = px;
    this.draw();
  }

  show(what, visible) {
    if (what === 'grid') this.grid.visible = visible;
    else this[what === 'points' ? 'submaps' : 'cameras'].show(visible);
    this.draw();
  }

  // Marks and lines of a measurement: points of the display's frame, the last joined to the first where it is closed.
  setMeasure(points, colour, isClosed) {
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
    points.forEach((to, i) => {
      if (i > 0 || isClosed) segments.push({ from: points.at(i - 1), to, colour: [...rgb, 1] });
    });
    const key = JSON.stringify(segments);
    if (key === this.measureKey) return;
    this.measureKey = key;
    this.measure.set(segments);
    this.draw();
  }

  // box: of the section, null: none; outline: the box that is drawn.
  setSection(box, outline = box, colour = '#888') {
    this.submaps.setSection(box);
    const key = box && JSON.stringify([outline, colour]);
    if (key === this.sectionKey) return;
    this.sectionKey = key;
    const rgba = [...new Color(colour).convertLinearToSRGB().toArray(), 0.8];
    this.section.set(box ? boxEdges(outline).map(([from, to]) => ({ from, to, colour: rgba })) : []);
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
    const camera = this.cameras.placed.get(image);
    if (!camera) return null;
    const depth = camera.size[2] * this.cameras.scale;
    return this.project(sim.add(camera.centre, sim.rotate(camera.q, [0, 0, 0.6 * depth])));
  }

  // All that is worth seeing, in the display's frame, where it is or will soon be.
  extent() {
    const points = this.submaps.ids().flatMap((id) => {
      const goal = this.submaps.goalOf(id);
      return goal ? this.submaps.samplePoints(id, 1500).map((p) => sim.apply(goal, p)) : [];
    });
    const views = [];
    for (const { submap, centre, worldFromCam } of this.cameras.all) {
      const goal = this.submaps.goalOf(submap);
      if (goal) views.push({ submap, centre: sim.apply(goal, centre), forward: sim.rotate(sim.multiply(goal.q, worldFromCam), [0, 0, 1]) });
    }
    return { points, views };
  }

  // From as near as possible so that nearly all of it is seen.
  fit({ keepDirection = true } = {}) {
    const { points, views } = this.extent();
    if (points.length + views.length === 0) return false;
    const { yaw, pitch } = keepDirection ? this.controls.goal : bestDirection(views);
    const axes = axesOf({ yaw, pitch, distance: 1 });
    for (const name of Object.keys(axes)) axes[name] = axes[name].toArray();
    const tanY = Math.tan((this.camera.fov * Math.PI) / 360) * 0.92;
    const lens = { tanX: tanY * this.camera.aspect, tanY, cameraDepth: this.cameras.base };
    const { target, distance, reach } = framing({ points, cameras: views.map((v) => v.centre) }, axes, lens);
    this.controls.goTo({ target, distance, yaw, pitch });
    this.setGridReach(1.1 * reach + 3);
    return true;
  }

  // Points that touch each other where the picture is full of them.
  get autoPointPx() {
    if (this.pointPx) return this.pointPx;
    const perPoint = (this.size.width * this.size.height) / Math.max(this.submaps.numPointsShown, 1);
    return Math.min(4, Math.max(2, 0.8 * Math.sqrt(perPoint)));
  }

  // From behind and above a camera, along its view.
  followCamera(image) {
    const camera = this.cameras.placed.get(image);
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
    const camera = this.cameras.placed.get(image);
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

  // ---- picking

  pickAt(x, y) {
    if (!this.picker || !this.size || x < 0 || y < 0 || x > this.size.width || y > this.size.height) return null;
    if (this.cameras.stale) this.cameras.place();
    return this.picker.pick(x, y, { ...this.size, pointPx: this.autoPointPx });
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

  // For tests: how many different colours a coarse sample of the picture has, their mean, and the share that is not paper.
  samplePixels() {
    this.renderer.render(this.scene, this.camera);
    const gl = this.renderer.getContext();
    const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const bytes = new Uint8Array(4 * w * h);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const colours = new Map();
    const sums = [0, 0, 0];
    let n = 0;
    for (let at = 0; at < bytes.length; at += 4 * 7) {
      const key = (bytes[at] << 16) | (bytes[at + 1] << 8) | bytes[at + 2];
      colours.set(key, (colours.get(key) ?? 0) + 1);
      sums.forEach((_, k) => (sums[k] += bytes[at + k]));
      n++;
    }
    return { colours: colours.size, mean: sums.map((sum) => sum / n), painted: 1 - Math.max(...colours.values()) / n };
  }
}

function makeRenderer(canvas) {
  try {
    return new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
  } catch {
    return null;
  }
}
