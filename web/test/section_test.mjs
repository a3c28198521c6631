import assert from 'node:assert/strict';
import test from 'node:test';
import { boundAt, boxEdges, displayBox, isUnbounded, rangesOf, stepOf, unbounded, visitInside, within } from '../src/section.js';
import * as sim from '../src/similarity.js';
import { randomOf } from '../test_server/synthetic.mjs';

const shownOf = (box, place, points) => {
  const shown = [];
  const visit = visitInside(box, place, (...p) => shown.push(p));
  for (const p of points) visit(...p);
  return shown;
};

test('North is -z of the display, east +x, up +y', () => {
  const box = displayBox([[1, 2], [-3, 4], [5, 6]]);
  assert.deepEqual(box, { low: [1, 5, -4], high: [2, 6, 3] });
});

test('Points inside of the box are visited, wherever their submap stands', () => {
  const random = randomOf(3);
  const points = Array.from({ length: 500 }, () => [0, 1, 2].map(() => 4 * random() - 2));
  const box = { low: [-1, -Infinity, -0.5], high: [1, 0.7, Infinity] };
  for (const place of [sim.identity(), { s: 0.6, q: sim.normalized([0.3, -0.8, 0.1, 0.4]), t: [0.2, -0.3, 0.1] }]) {
    const isInside = (p) => sim.apply(place, p).every((v, k) => v >= box.low[k] && v <= box.high[k]);
    const wanted = points.filter(isInside);
    assert.ok(wanted.length > 20 && wanted.length < 480);
    assert.deepEqual(shownOf(box, place, points), wanted);
  }
});

test('Without bounds nothing is hidden', () => {
  const far = [[1e9, -1e9, 0]];
  assert.ok(isUnbounded(unbounded()) && !isUnbounded([[-Infinity, 3], ...unbounded().slice(1)]));
  assert.deepEqual(shownOf(displayBox(unbounded()), sim.identity(), far), far);
});

test('Sliders reach all but outliers, and at their ends hide none of these', () => {
  const points = Array.from({ length: 1000 }, (_, i) => [i / 999, 0, 0]).concat([[500, 0, 0]]);
  const [east, north, up] = rangesOf(points);
  assert.ok(east[0] < 0 && east[1] > 0.99 && east[1] < 1.1, JSON.stringify(east));
  assert.ok(north[0] < north[1] && up[0] < up[1], 'a flat map has a range to slide along');
  assert.deepEqual([boundAt(east, 0, 0, 200), boundAt(east, 1, 200, 200)], [-Infinity, Infinity]);
  for (const at of [0, 1, 77, 199, 200]) assert.equal(stepOf(east, boundAt(east, 0, at, 200), 200), at);
  assert.equal(stepOf(east, Infinity, 200), 200);
  assert.deepEqual(within([[-Infinity, 0.5]], [east]), [[east[0], 0.5]]);
  assert.equal(rangesOf([]), null);
});

test('A box has 12 edges, each along one axis', () => {
  const edges = boxEdges({ low: [0, 0, 0], high: [1, 2, 3] });
  assert.equal(edges.length, 12);
  for (const [a, b] of edges) assert.equal(a.filter((v, k) => v !== b[k]).length, 1);
  assert.equal(edges.reduce((sum, [a, b]) => sum + sim.distance(a, b), 0), 4 * (1 + 2 + 3));
});
