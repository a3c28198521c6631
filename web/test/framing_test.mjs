import assert from 'node:assert/strict';
import test from 'node:test';
import { bestDirection, framing } from '../src/view/framing.js';

const kAxes = { right: [1, 0, 0], up: [0, 1, 0], forward: [0, 0, -1] };
const kLens = { tanX: 0.5, tanY: 0.25, cameraDepth: 0.4 };

// In units of half the picture: at most 1 where it is seen.
function seenAt(p, { target, distance }, { tanX, tanY }) {
  const depth = distance - (p[2] - target[2]);
  return Math.max(Math.abs(p[0] - target[0]) / (depth * tanX), Math.abs(p[1] - target[1]) / (depth * tanY));
}

function box(n, [a, b, c], middle) {
  const points = [];
  for (let i = 0; i < n; ++i) {
    for (let j = 0; j < n; ++j) {
      for (let k = 0; k < n; ++k) points.push([i, j, k].map((v, axis) => middle[axis] + (2 * v / (n - 1) - 1) * [a, b, c][axis]));
    }
  }
  return points;
}

test('nearly all is seen, from as near as possible', () => {
  for (const size of [[10, 1, 1], [1, 10, 1], [2, 2, 8]]) {
    const points = box(11, size, [5, -3, 2]);
    const view = framing({ points, cameras: [] }, kAxes, kLens);
    const outside = points.filter((p) => seenAt(p, view, kLens) > 1 + 1e-9).length;
    assert.ok(outside <= 0.05 * points.length, `${outside} points are outside`);
    const nearer = { ...view, distance: 0.9 * view.distance };
    assert.ok(points.filter((p) => seenAt(p, nearer, kLens) > 1).length > 0.05 * points.length, 'nearer would do');
  }
});

test('single points far away do not count, and cameras do', () => {
  const points = box(11, [2, 2, 2], [0, 0, 0]);
  const alone = framing({ points, cameras: [] }, kAxes, kLens);
  const far = framing({ points: [...points, [1e6, 0, 0], [0, -1e6, 0]], cameras: [] }, kAxes, kLens);
  assert.ok(Math.abs(far.distance - alone.distance) < 0.1 * alone.distance);
  const camera = [8, 0, 0];
  const both = framing({ points, cameras: [[-8, 0, 0], camera] }, kAxes, kLens);
  assert.ok(seenAt(camera, both, kLens) < 1);
});

test('a single point is not looked at from inside, and a huge map has an end', () => {
  assert.deepEqual(framing({ points: [[1, 2, 3]], cameras: [] }, kAxes, kLens), { target: [1, 2, 3], distance: 2, reach: 0 });
  assert.equal(framing({ points: box(3, [1e6, 1, 1], [0, 0, 0]), cameras: [] }, kAxes, kLens).distance, 4000);
});

test('a facade is looked at as its photos are, an object from the side and several maps from the front', () => {
  const facade = [-0.2, 0, 0.2].map((x) => ({ submap: 1, forward: [x, 0, -Math.sqrt(1 - x * x)] }));
  assert.ok(Math.abs(bestDirection(facade).yaw - 0.4) < 1e-9);
  const around = [0, 1, 2, 3].map((i) => ({ submap: 1, forward: [Math.cos(i * Math.PI / 2), 0, Math.sin(i * Math.PI / 2)] }));
  assert.deepEqual(bestDirection(around), { yaw: 0.6, pitch: 0.45 });
  assert.equal(bestDirection([...facade, { ...facade[0], submap: 2 }]).yaw, 0.15);
  assert.equal(bestDirection([{ submap: 1, forward: [0, -1, 0] }]).pitch, 0.95);
  assert.deepEqual(bestDirection([]), { yaw: 0.6, pitch: 0.45 });
});
