import assert from 'node:assert/strict';
import test from 'node:test';
import { coordinatesOf, georeference, guessUp, joined, measureSubmap, sideBySide, standing } from '../src/frames.js';
import * as sim from '../src/similarity.js';
import { coordinateWords } from '../src/words.js';
import { makeSession, randomOf } from '../test_server/synthetic.mjs';

const near = (a, b, eps = 1e-9) => assert.ok(a.every((v, i) => Math.abs(v - b[i]) <= eps), `${a} is not ${b}`);
const degreesBetween = (a, b) => (Math.acos(Math.min(1, sim.dot(sim.unit(a), sim.unit(b)))) * 180) / Math.PI;

function randomSimilarity(random) {
  const q = sim.normalized([random() - 0.5, random() - 0.5, random() - 0.5, random() - 0.5]);
  return { s: 0.2 + 3 * random(), q, t: [random(), -4 * random(), 9 * random()] };
}

test('Similarities compose, invert and interpolate', () => {
  const random = randomOf(3);
  for (let i = 0; i < 20; ++i) {
    const a = randomSimilarity(random);
    const b = randomSimilarity(random);
    const x = [random(), random(), random()];
    near(sim.apply(sim.compose(a, b), x), sim.apply(a, sim.apply(b, x)));
    near(sim.apply(sim.invert(a), sim.apply(a, x)), x);
    near(sim.apply(sim.interpolate(a, b, 0, x), x), sim.apply(a, x));
    near(sim.apply(sim.interpolate(a, b, 1, x), [1, 2, 3]), sim.apply(b, [1, 2, 3]));
    near(sim.rotate(sim.rotationBetween(sim.unit([1, 2, 3]), sim.unit(x)), sim.unit([1, 2, 3])), sim.unit(x));
  }
  near(sim.rotate(sim.rotationBetween([0, 1, 0], [0, -1, 0]), [0, 1, 0]), [0, -1, 0]);
  assert.equal(sim.fromArray([0, 1, 0, 0, 0, 0, 0, 0]), null);
  assert.equal(sim.fromArray(undefined), null);
});

test('The fitted similarity is the one that was applied, and none where points lie on a line', () => {
  const random = randomOf(5);
  const b = Array.from({ length: 9 }, () => [random(), 2 * random(), random()]);
  for (let i = 0; i < 10; ++i) {
    const wanted = randomSimilarity(random);
    const m = sim.fitSimilarity(b.map((p) => sim.apply(wanted, p)), b);
    near(sim.apply(m, [1, 2, 3]), sim.apply(wanted, [1, 2, 3]), 1e-6);
  }
  const line = [0, 1, 2, 3].map((v) => [v, 2 * v, 0]);
  assert.equal(sim.fitSimilarity(line, line), null);
});

const placesOf = (session, frame) => session.photos.map((p) => ({
  centre: sim.apply(frame, p.centre), worldFromCam: sim.multiply(frame.q, p.worldFromCam),
}));

test('Up is found for photos along a street, whatever the frame', () => {
  const session = makeSession({ photosEach: 12, numPoints: 300 });
  for (const frame of Object.values(session.frames)) {
    const up = guessUp(placesOf(session, frame));
    assert.ok(degreesBetween(up, sim.rotate(frame.q, [0, 0, 1])) < 12);
  }
});

test('Up is found for photos from above in two directions of flight', () => {
  const places = [];
  for (let i = 0; i < 20; ++i) {
    const turned = i < 10 ? [0, 1, 0, 0] : sim.multiply(sim.normalized([1, 0, 0, 1]), [0, 1, 0, 0]); // z down
    places.push({ centre: [i % 5, Math.floor(i / 5), 30], worldFromCam: turned });
  }
  assert.ok(degreesBetween(guessUp(places), [0, 0, 1]) < 5);
});

test('GPS tells the scale and up; outliers and noise do not spoil it; without extent there is none', () => {
  const session = makeSession({ photosEach: 12, numPoints: 300, gps: true });
  const frame = session.frames[1];
  const random = randomOf(2);
  const gps = new Map(session.events.filter((e) => e.kind === 'photo').map((e) => [e.image, e.gps]));
  const photos = placesOf(session, frame).map((p, i) => ({ ...p, gps: [...gps.get(i + 1)] }));
  photos[4].gps[0] += 0.01;
  for (const p of photos) p.gps[2] += 0.3 * random();
  const geo = georeference(photos);
  assert.ok(Math.abs(geo.localFromSubmap.s * frame.s - 1) < 0.03, `scale ${geo.localFromSubmap.s * frame.s}`);
  const flat = georeference(photos.map((p, i) => (i % 2 ? p : { ...p, gps: p.gps.slice(0, 2) })));
  assert.ok(Math.abs(flat.localFromSubmap.s * frame.s - 1) < 0.05, `without half of the altitudes: scale ${flat.localFromSubmap.s * frame.s}`);
  assert.equal(georeference(photos.slice(0, 3)), null);
  assert.equal(georeference(photos.map((p) => ({ ...p, gps: [52, 13, 3] }))), null);
});

test('A submap stands upright on the floor, a step between photos is one, and others stand beside it', () => {
  const session = makeSession({ photosEach: 12, numPoints: 300 });
  const submaps = [1, 2].map((id) => {
    const photos = placesOf(session, session.frames[id]).filter((_, i) => session.photos[i].submap === id);
    const points = session.points.map((p) => sim.apply(session.frames[id], p.xyz));
    return { id, photos, points, measure: measureSubmap(photos, points) };
  });
  const places = sideBySide(submaps);
  for (const { id, photos } of submaps) {
    const place = places.get(id);
    const steps = photos.slice(1).map((p, i) => sim.distance(sim.apply(place, p.centre), sim.apply(place, photos[i].centre)));
    steps.sort((a, b) => a - b);
    assert.ok(Math.abs(steps[5] - 1) < 0.35, `a step of ${steps[5]}`);
    assert.ok(degreesBetween(sim.rotate(sim.multiply(place.q, session.frames[id].q), [0, 0, 1]), [0, 1, 0]) < 12);
    const views = photos.map((p) => sim.rotate(sim.multiply(place.q, p.worldFromCam), [0, 0, 1])).reduce(sim.add);
    assert.ok(degreesBetween([views[0], 0, views[2]], [0, 0, -1]) < 1, 'cameras look away from the viewer');
  }
  const reach = (id) => submaps[id - 1].points.map((p) => sim.apply(places.get(id), p)[0]);
  const sorted = (v) => v.sort((a, b) => a - b);
  assert.ok(sorted(reach(1))[Math.floor(0.9 * 300)] < sorted(reach(2))[Math.floor(0.1 * 300)]);
  near(sim.apply(standing(submaps[0].measure), submaps[0].measure.middle).filter((_, k) => k !== 1), [0, 0], 1e-9);
});

test('A joined submap falls on its target', () => {
  const session = makeSession({ photosEach: 8, numPoints: 100 });
  const order = session.events.find((e) => e.kind === 'merge' && e.similarity);
  const display = { s: 2, q: sim.normalized([1, 2, 3, 4]), t: [5, 6, 7] };
  const place = joined(display, sim.fromArray(order.similarity));
  for (const point of session.points.slice(0, 10)) {
    near(sim.apply(place, sim.apply(session.frames[2], point.xyz)), sim.apply(display, sim.apply(session.frames[1], point.xyz)), 1e-9);
  }
});

test('A point has metres from a photo and degrees where GPS tells, and no altitude where photos have none', () => {
  const session = makeSession({ photosEach: 12, numPoints: 300, gps: true });
  const frame = session.frames[1];
  const gps = session.events.filter((e) => e.kind === 'photo').map((e) => e.gps);
  const photos = placesOf(session, frame).map((p, i) => ({ ...p, image: i + 1, gps: gps[i] }));
  const point = [3, 8, 2.5]; // metres east, north and up of 52.5 N, 13.4 E, 34 m
  const own = sim.apply(frame, point);
  const at = coordinatesOf(georeference(photos), own);
  const [east, north, up] = sim.subtract(point, session.photos[0].centre);
  near([at.east, at.north, at.up, at.altitude], [east, north, up, 36.5], 0.02);
  near([at.latitude, at.longitude], [52.5 + 8 / 111132.95, 13.4 + 3 / (111319.49 * Math.cos((52.5 * Math.PI) / 180))], 3e-7);
  const words = new Map(coordinateWords(at, (image) => `photo ${image}`));
  assert.match(words.get('Metres'), /^2[12]\.\d+\sm east, 1\d\.\d+\sm north, 0\.\d+\sm up from photo 1$/);
  assert.match(words.get('Degrees'), /^52\.50007\d+, 13\.40004\d+$/);
  assert.match(words.get('Altitude'), /^36\.\d+\sm/);
  const level = coordinatesOf(georeference(photos.map((p) => ({ ...p, gps: p.gps.slice(0, 2) }))), own);
  assert.deepEqual([level.up, level.altitude], [null, null]);
  assert.ok(Math.abs(level.north - north) < 3, `${level.north} m north`); // photos along a street hardly tell its roll
  assert.ok(!new Map(coordinateWords(level, String)).has('Altitude'));
  assert.match(new Map(coordinateWords({ ...at, east: -2, north: -1, up: -3 }, String)).get('Metres'), /m west, .*m south, .*m down/);
});
