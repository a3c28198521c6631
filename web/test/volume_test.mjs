import assert from 'node:assert/strict';
import test from 'node:test';
import * as sim from '../src/similarity.js';
import { kCellPoints, measureHeap } from '../src/volume.js';
import { randomOf } from '../test_server/synthetic.mjs';

const kRadius = 2;
const kTop = 1.5;
const kUp = [0, 0, 1];
// Around a heap at the origin, neither level nor a square.
const kCorners = [[-2.5, -2.6, 0], [2.6, -2.4, 0], [2.8, 2.5, 0], [-2.4, 2.7, 0]];
const kArea = 26.265; // by the shoelace formula
const kBase = Math.PI * kRadius ** 2;

const heaps = {
  paraboloid: { at: (r) => Math.max(0, kTop * (1 - (r / kRadius) ** 2)), volume: (kBase * kTop) / 2 },
  cone: { at: (r) => Math.max(0, kTop * (1 - r / kRadius)), volume: (kBase * kTop) / 3 },
};

// Points of a surface z(x, y) at random places of a square, the denser the further left.
function pointsOf(z, { n = 20000, seed = 1 } = {}) {
  const random = randomOf(seed);
  return Array.from({ length: n }, () => {
    const [x, y] = [-3.3 + 6.6 * random() ** 1.5, -3.3 + 6.6 * random()];
    return [x, y, z(x, y, random)];
  });
}

const measure = (points, { corners = kCorners, up = kUp } = {}) => measureHeap(corners, up, (visit) => points.forEach((p) => visit(...p)));
const near = (a, b, share, what) => assert.ok(Math.abs(a - b) <= share * b, `${what}: ${a} is not ${b}`);

for (const [name, { at, volume }] of Object.entries(heaps)) {
  test(`A ${name}: its volume within 1 %, nothing below, in any frame`, () => {
    const points = pointsOf((x, y) => at(Math.hypot(x, y)));
    for (const frame of [sim.identity(), { s: 0.03, q: sim.normalized([0.4, -0.7, 0.2, 0.5]), t: [40, -7, 3] }]) {
      const moved = (p) => sim.apply(frame, p);
      const heap = measure(points.map(moved), { corners: kCorners.map(moved), up: sim.rotate(frame.q, kUp) });
      near(heap.above / frame.s ** 3, volume, 0.01, 'volume');
      near(heap.area / frame.s ** 2, kArea, 1e-6, 'area');
      assert.ok(heap.below < 0.001 * heap.above && heap.empty < 0.01 && heap.why === null, JSON.stringify(heap));
    }
  });
}

test('A pit is below its base; the order of the corners does not matter', () => {
  const points = pointsOf((x, y) => -heaps.cone.at(Math.hypot(x, y)));
  for (const corners of [kCorners, [...kCorners].reverse()]) {
    const heap = measure(points, { corners });
    near(heap.below, heaps.cone.volume, 0.01, 'volume');
    assert.ok(heap.above < 0.001 * heap.below);
  }
});

test('The base follows a slope, and its area is that of the slope', () => {
  const points = pointsOf((x, y) => heaps.cone.at(Math.hypot(x, y)) + 0.5 * x - 0.2 * y);
  const heap = measure(points, { corners: kCorners.map(([x, y]) => [x, y, 0.5 * x - 0.2 * y]) });
  near(heap.above, heaps.cone.volume, 0.01, 'volume'); // shear keeps it
  near(heap.area, kArea * Math.hypot(1, 0.5, 0.2), 1e-3, 'area');
});

test('Corners that were picked a little too high or low change little: the points of the border are the base', () => {
  const points = pointsOf((x, y) => heaps.paraboloid.at(Math.hypot(x, y)));
  const heap = measure(points, { corners: kCorners.map(([x, y], i) => [x, y, i % 2 ? 0.05 : -0.05]) });
  near(heap.above, heaps.paraboloid.volume, 0.01, 'volume');
});

test('Noise counts above and below alike', () => {
  const heap = measure(pointsOf((x, y, random) => heaps.cone.at(Math.hypot(x, y)) + 0.1 * (random() - 0.5)));
  assert.ok(heap.below > 0.005 * heap.above, 'no noise');
  near(heap.above - heap.below, heaps.cone.volume, 0.01, 'volume');
});

test('A cell holds about 8 points in the median of the cells that hold any', () => {
  const points = pointsOf(() => 0);
  const { cell } = measure(points);
  const counts = new Map();
  for (const [x, y] of points) {
    if (Math.abs(x) > 2.4 || Math.abs(y) > 2.4) continue;
    const key = `${Math.floor(x / cell)} ${Math.floor(y / cell)}`;
    counts.set(key, (counts.get(key) ?? 0) + 1);
  }
  const sorted = [...counts.values()].sort((a, b) => a - b);
  assert.ok(Math.abs(sorted[sorted.length >> 1] - kCellPoints) <= 2, `${sorted[sorted.length >> 1]}`);
});

test('A hole is told, and goes on as its surroundings', () => {
  const slope = pointsOf((x, y) => heaps.cone.at(Math.hypot(x, y)), { n: 40000 });
  const hole = 0.5;
  const heap = measure(slope.filter(([x, y]) => Math.hypot(x - 1, y) > hole));
  near(heap.empty, (Math.PI * hole ** 2) / kArea, 0.15, 'share');
  near(heap.above, heaps.cone.volume, 0.01, 'volume');
});

test('Points in few places do not make cells without end', () => {
  const heap = measure(pointsOf(() => 0, { n: 50 }).flatMap((p) => Array(100).fill(p)));
  assert.ok(heap.cell ** 2 * 5000 > kArea && heap.empty > 0.9, JSON.stringify(heap));
  assert.ok(Number.isFinite(heap.above) && Number.isFinite(heap.below));
});

test('A polygon with a bay: only its inside counts', () => {
  const corners = [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [0, -1, 0], [-2, 2, 0]];
  const blocks = (x, y) => (Math.abs(x) > 0.3 ? 0 : y > 1.2 ? 5 : y > -1.8 && y < -1.3 ? 1 : 0); // in the bay, and inside
  const heap = measure(pointsOf(blocks, { n: 80000 }), { corners });
  near(heap.area, 10, 1e-6, 'area');
  near(heap.above, 0.6 * 0.5, 0.05, 'volume');
});

test('Corners that make no polygon: fewer than three, sides that cross, on a line', () => {
  const points = pointsOf(() => 0, { n: 1000 });
  const [a, b, c, d] = kCorners;
  for (const corners of [[], [a], [a, b], [a, c, b, d], [a, b, a], [[0, 0, 0], [1, 1, 0], [2, 2, 0]], [a, a, a]]) {
    assert.equal(measure(points, { corners }), null, JSON.stringify(corners));
  }
});

test('Without points inside, or with few of them, there is an area and no volume', () => {
  for (const points of [[], kCorners, pointsOf(() => 0).map(([x, y, z]) => [x + 20, y, z]), pointsOf(() => 0, { n: 24 })]) {
    const heap = measure(points);
    assert.deepEqual([heap.why, heap.above], ['points', undefined]);
    near(heap.area, kArea, 1e-6, 'area');
  }
});

test('A wall has an area, and no above', () => {
  const upright = ([x, y, z]) => [x, z, y];
  const heap = measure(pointsOf(() => 0).map(upright), { corners: kCorners.map(upright) });
  assert.deepEqual([heap.why, heap.above], ['steep', undefined]);
  near(heap.area, kArea, 1e-3, 'area');
});
