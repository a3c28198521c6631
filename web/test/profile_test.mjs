import assert from 'node:assert/strict';
import test from 'node:test';
import { heightRange, kCells, profileAlong, profileCsv, scaledProfile, stretches, ticks } from '../src/profile.js';
import * as sim from '../src/similarity.js';
import { randomOf } from '../test_server/synthetic.mjs';

const kUp = [0, 0, 1];

// Points of a surface z(x, y) over a square of 12 x 12.
function pointsOf(z, n = 60000) {
  const random = randomOf(5);
  return Array.from({ length: n }, () => {
    const [x, y] = [12 * random() - 1, 12 * random() - 6];
    return [x, y, z(x, y)];
  });
}
const along = (a, b, points, up = kUp) => profileAlong(a, b, up, (visit) => points.forEach((p) => visit(...p)));
const bank = (x) => Math.max(0, Math.min(2, x - 3)); // rises by 2 from 3 to 5

test('Heights follow the surface, over the first point, in any frame', () => {
  const points = pointsOf((x) => 7 + bank(x));
  const [a, b] = [[0, 0, 7], [10, 0, 9]];
  for (const frame of [sim.identity(), { s: 0.04, q: sim.normalized([0.4, -0.7, 0.2, 0.5]), t: [40, -7, 3] }]) {
    const [fa, fb, ...moved] = [a, b, ...points].map((p) => sim.apply(frame, p));
    const profile = scaledProfile(along(fa, fb, moved, sim.rotate(frame.q, kUp)), 1 / frame.s);
    assert.ok(Math.abs(profile.length - 10) < 1e-9 && Math.abs(profile.to - 2) < 1e-9 && profile.from === 0);
    assert.equal(profile.cells.length, kCells);
    for (const { distance, height, points: n } of profile.cells) {
      if (n > 0) assert.ok(Math.abs(height - bank(distance)) < 0.06, `${height} at ${distance}`);
    }
    // 60 000 on 144: within a strip of 10 x 0.2 about 830.
    assert.ok(profile.numPoints > 700 && profile.numPoints < 970, String(profile.numPoints));
    assert.equal(profile.cells.reduce((n, c) => n + c.points, 0), profile.numPoints);
  }
});

test('Points beside the strip or beyond its ends are not in it', () => {
  const profile = along([0, 0, 0], [10, 0, 0], [[5, 0.09, 1], [5, 0.11, 9], [-0.01, 0, 9], [10.01, 0, 9], [10, 0, 2]]);
  assert.equal(profile.numPoints, 2);
  assert.deepEqual(heightRange(profile), [0, 2]);
});

test('A hole is a gap, and has no height', () => {
  const points = pointsOf(() => 0).filter(([x]) => x < 4 || x > 6);
  const profile = along([0, 0, 0], [10, 0, 0], points);
  const empty = profile.cells.filter((c) => c.distance > 4.1 && c.distance < 5.9);
  assert.ok(empty.length > 15 && empty.every((c) => c.points === 0 && c.height === null && c.lowest === null));
  const parts = stretches(profile.cells);
  assert.ok(parts.length >= 2 && parts.flat().every((c) => c.points > 0));
  assert.deepEqual(stretches([]), []);
});

test('Two points over each other, or at one place, have no profile', () => {
  assert.equal(along([0, 0, 0], [0.01, 0, 5], []), null);
  assert.equal(along([1, 2, 3], [1, 2, 3], []), null);
});

test('Without points a profile has its ends alone', () => {
  const profile = along([0, 0, 0], [3, 4, 1], []);
  assert.deepEqual([profile.length, profile.numPoints, stretches(profile.cells).length, heightRange(profile)], [5, 0, 0, [0, 1]]);
});

test('Ticks are round, few and within the range', () => {
  assert.deepEqual(ticks(0, 10, 5), [0, 2, 4, 6, 8, 10]);
  assert.deepEqual(ticks(-0.31, 0.42, 4), [-0.2, 0, 0.2, 0.4]);
  assert.deepEqual(ticks(3, 3, 4), [3]);
  for (const [low, high] of [[0, 27.3], [-1e-3, 4e-3], [100.2, 100.9], [0, 99999]]) {
    const found = ticks(low, high, 5);
    assert.ok(found.length >= 2 && found.length <= 6, `${low} to ${high}: ${found}`);
    assert.ok(found.every((v) => v >= low - 1e-9 && v <= high + 1e-9));
  }
});

test('CSV: a header with the unit, a line a cell, nothing where there is no point', () => {
  const csv = profileCsv({ cells: [{ distance: 0.5, points: 3, height: 1 / 3, lowest: -1, highest: 2 }, { distance: 1.5, points: 0, height: null, lowest: null, highest: null }] }, 'm');
  assert.deepEqual(csv.split('\r\n'), ['distance_m,height_m,lowest_m,highest_m,points', '0.5,0.3333333,-1,2,3', '1.5,,,,0', '']);
});
