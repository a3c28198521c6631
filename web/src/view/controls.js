// Orbit, pan, zoom and fly, by mouse, touch, pen and keyboard. The view is a target, a distance and two angles, so it
// can be described, animated and tested without a canvas.
import { Vector3 } from 'three';

const kSlowestPitch = 0.02; // rad from straight up or down
const kClickPx = 6;
const kClickMs = 600;

export class Controls {
  // on: {change(), click(x, y), focus(x, y), hover(x, y), leave()}; x and y in CSS pixels of the element
  constructor(element, camera, on, { reducedMotion = () => false } = {}) {
    this.element = element;
    this.camera = camera;
    this.on = on;
    this.reducedMotion = reducedMotion;
    this.goal = { target: new Vector3(), distance: 12, yaw: 0.6, pitch: 0.5 };
    this.now = { target: new Vector3(), distance: 12, yaw: 0.6, pitch: 0.5 };
    this.flying = false;
    this.moved = false; // by the user, since it was last asked
    this.pointers = new Map();
    this.keys = new Set();
    this.listen();
  }

  listen() {
    const { element } = this;
    element.addEventListener('pointerdown', (e) => this.pointerDown(e));
    element.addEventListener('pointermove', (e) => this.pointerMove(e));
    for (const type of ['pointerup', 'pointercancel']) element.addEventListener(type, (e) => this.pointerUp(e));
    element.addEventListener('pointerleave', () => this.on.leave());
    element.addEventListener('wheel', (e) => this.wheel(e), { passive: false });
    element.addEventListener('dblclick', (e) => this.on.focus(...this.at(e)));
    element.addEventListener('contextmenu', (e) => e.preventDefault());
    element.addEventListener('keydown', (e) => this.keyDown(e));
    element.addEventListener('keyup', (e) => this.keys.delete(e.code));
    element.addEventListener('blur', () => this.keys.clear());
  }

  at(event) {
    const box = this.element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  pointerDown(e) {
    this.element.setPointerCapture?.(e.pointerId);
    const [x, y] = this.at(e);
    this.pointers.set(e.pointerId, { x, y, fromX: x, fromY: y, since: e.timeStamp, button: e.button, shift: e.shiftKey });
    if (this.pointers.size > 1) for (const p of this.pointers.values()) p.since = -Infinity; // no click
  }

  pointerMove(e) {
    const pointer = this.pointers.get(e.pointerId);
    const [x, y] = this.at(e);
    if (!pointer) {
      if (e.pointerType !== 'touch') this.on.hover(x, y);
      return;
    }
    const dx = x - pointer.x;
    const dy = y - pointer.y;
    if (dx === 0 && dy === 0) return;
    if (this.pointers.size === 2) this.pinch(e.pointerId, x, y);
    pointer.x = x;
    pointer.y = y;
    const dragged = Math.hypot(x - pointer.fromX, y - pointer.fromY) > kClickPx;
    if (dragged) pointer.since = -Infinity;
    if (this.pointers.size !== 1) return;
    if (pointer.button === 2 || pointer.button === 1 || pointer.shift) this.pan(dx, dy);
    else this.turn(dx, dy);
    this.touched();
  }

  pointerUp(e) {
    const pointer = this.pointers.get(e.pointerId);
    if (!pointer) return;
    this.pointers.delete(e.pointerId);
    const clicked = e.type === 'pointerup' && e.timeStamp - pointer.since < kClickMs && pointer.button === 0;
    if (clicked) this.on.click(...this.at(e));
  }

  // Two fingers: their middle pans, their distance zooms.
  pinch(id, x, y) {
    const [first, second] = [...this.pointers.entries()];
    const [, other] = first[0] === id ? second : first;
    const moved = this.pointers.get(id);
    const before = Math.hypot(moved.x - other.x, moved.y - other.y);
    const after = Math.hypot(x - other.x, y - other.y);
    this.pan((x - moved.x) / 2, (y - moved.y) / 2);
    if (before > 10 && after > 10) this.zoom(before / after, (x + other.x) / 2, (y + other.y) / 2);
    this.touched();
  }

  wheel(e) {
    e.preventDefault();
    const lines = e.deltaMode === 1 ? 30 : e.deltaMode === 2 ? 300 : 1;
    const amount = Math.max(-240, Math.min(240, e.deltaY * lines));
    this.zoom(Math.exp(amount * (e.ctrlKey ? 0.008 : 0.0018)), ...this.at(e));
    this.touched();
  }

  keyDown(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    if (!kMoves[e.code] && e.code !== 'ShiftLeft' && e.code !== 'ShiftRight') return;
    if (kMoves[e.code]) e.preventDefault();
    this.keys.add(e.code);
    this.touched();
  }

  touched() {
    this.moved = true;
    this.on.change();
  }

  get height() {
    return this.element.clientHeight || 1;
  }

  turn(dx, dy) {
    const { goal } = this;
    const speed = this.flying ? 2.2 : 4.5;
    const eye = this.flying ? eyeOf(goal) : null;
    const sign = this.flying ? -0.6 : 1;
    goal.yaw -= (sign * speed * dx) / this.height;
    goal.pitch = clampPitch(goal.pitch + (sign * speed * dy) / this.height);
    if (eye) goal.target.copy(eye).sub(offsetOf(goal));
  }

  pan(dx, dy) {
    const { goal } = this;
    const perPx = (2 * goal.distance * Math.tan((this.camera.fov * Math.PI) / 360)) / this.height;
    const { right, up } = axesOf(goal);
    goal.target.addScaledVector(right, -dx * perPx).addScaledVector(up, dy * perPx);
  }

  // The point of the target's plane under (x, y) stays under it.
  zoom(factor, x, y) {
    const { goal } = this;
    const clamped = Math.max(0.02, Math.min(5000, goal.distance * factor)) / goal.distance;
    const perPx = (2 * goal.distance * Math.tan((this.camera.fov * Math.PI) / 360)) / this.height;
    const { right, up } = axesOf(goal);
    const cx = (x - this.element.clientWidth / 2) * perPx;
    const cy = (this.height / 2 - y) * perPx;
    goal.target.addScaledVector(right, cx * (1 - clamped)).addScaledVector(up, cy * (1 - clamped));
    goal.distance *= clamped;
  }

  // Looks from `eye` to `target`; or from the present direction at `target` from `distance`.
  goTo({ target, distance, eye, yaw, pitch }) {
    const { goal } = this;
    if (target) goal.target.set(...target);
    if (distance) goal.distance = distance;
    if (eye) {
      const offset = new Vector3(...eye).sub(goal.target);
      goal.distance = Math.max(offset.length(), 0.05);
      goal.yaw = nearestTurn(Math.atan2(offset.x, offset.z), this.now.yaw);
      goal.pitch = clampPitch(Math.asin(Math.max(-1, Math.min(1, offset.y / goal.distance))));
    }
    if (yaw !== undefined) goal.yaw = nearestTurn(yaw, this.now.yaw);
    if (pitch !== undefined) goal.pitch = clampPitch(pitch);
    this.on.change();
  }

  // Moves the camera towards where it is to be. Returns whether it is still on its way.
  update(dt) {
    this.moveByKeys(dt);
    const { goal, now } = this;
    const f = this.reducedMotion() ? 1 : 1 - Math.exp(-dt * 14);
    now.target.lerp(goal.target, f);
    now.distance *= Math.exp(f * Math.log(goal.distance / now.distance));
    now.yaw += f * (goal.yaw - now.yaw);
    now.pitch += f * (goal.pitch - now.pitch);
    const left =
      now.target.distanceTo(goal.target) / goal.distance + Math.abs(Math.log(goal.distance / now.distance)) +
      Math.abs(goal.yaw - now.yaw) + Math.abs(goal.pitch - now.pitch);
    const arrived = left < 1e-4;
    if (arrived) Object.assign(now, { distance: goal.distance, yaw: goal.yaw, pitch: goal.pitch }).target.copy(goal.target);
    this.camera.position.copy(eyeOf(now));
    this.camera.lookAt(now.target);
    this.camera.near = now.distance / 500;
    this.camera.far = now.distance * 400;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    return !arrived || this.isMovingByKeys();
  }

  // As it is seen now.
  describe() {
    const { now, flying } = this;
    const { right, up, forward } = axesOf(now);
    const plain = (v) => v.toArray();
    return {
      flying, distance: now.distance, yaw: now.yaw, pitch: now.pitch, target: plain(now.target), eye: plain(eyeOf(now)),
      right: plain(right), up: plain(up), forward: plain(forward),
    };
  }

  isMovingByKeys() {
    return [...this.keys].some((code) => kMoves[code]);
  }

  moveByKeys(dt) {
    if (!this.isMovingByKeys()) return;
    const { goal } = this;
    const { right, forward } = axesOf(goal);
    const fast = this.keys.has('ShiftLeft') || this.keys.has('ShiftRight') ? 3 : 1;
    const step = Math.min(dt, 0.1) * fast;
    for (const code of this.keys) {
      const [what, sign] = kMoves[code] ?? [];
      if (what === 'forward') goal.target.addScaledVector(forward, sign * step * goal.distance * 0.9);
      if (what === 'right') goal.target.addScaledVector(right, sign * step * goal.distance * 0.9);
      if (what === 'up') goal.target.y += sign * step * goal.distance * 0.7;
      if (what === 'yaw') this.turn(sign * step * this.height * 0.3, 0);
      if (what === 'pitch') this.turn(0, sign * step * this.height * 0.3);
      if (what === 'zoom') goal.distance *= Math.exp(sign * step * 1.5);
    }
  }
}

const kMoves = {
  KeyW: ['forward', 1], KeyS: ['forward', -1], KeyD: ['right', 1], KeyA: ['right', -1], KeyE: ['up', 1], KeyQ: ['up', -1],
  ArrowLeft: ['yaw', -1], ArrowRight: ['yaw', 1], ArrowUp: ['pitch', -1], ArrowDown: ['pitch', 1],
  Equal: ['zoom', -1], NumpadAdd: ['zoom', -1], Minus: ['zoom', 1], NumpadSubtract: ['zoom', 1],
};

const clampPitch = (pitch) => Math.max(kSlowestPitch - Math.PI / 2, Math.min(Math.PI / 2 - kSlowestPitch, pitch));

function nearestTurn(angle, from) {
  return angle + 2 * Math.PI * Math.round((from - angle) / (2 * Math.PI));
}

// From the target to the eye.
export function offsetOf({ distance, yaw, pitch }) {
  return new Vector3(
    distance * Math.cos(pitch) * Math.sin(yaw), distance * Math.sin(pitch), distance * Math.cos(pitch) * Math.cos(yaw));
}

export function eyeOf(view) {
  return offsetOf(view).add(view.target);
}

export function axesOf(view) {
  const forward = offsetOf(view).normalize().negate();
  const right = new Vector3().crossVectors(forward, new Vector3(0, 1, 0)).normalize();
  const up = new Vector3().crossVectors(right, forward);
  return { right, up, forward };
}
