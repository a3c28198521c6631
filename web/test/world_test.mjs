import assert from 'node:assert/strict';
import test from 'node:test';
import { emptyState } from '../src/fold.js';
import { identity } from '../src/similarity.js';
import { World } from '../src/world.js';

// A viewer in which a submap moves from setPlace on until it is told to rest.
function makeViewer() {
  const moving = new Set();
  const submaps = {
    placeOf: identity, goalOf: identity, samplePoints: () => [], setPlace: (id) => moving.add(id), isMoving: (id) => moving.has(id),
    drop: (id) => moving.delete(id), placeMesh: () => {},
  };
  return { submaps, rest: () => moving.clear() };
}

test('a submap that is joined moves, although its target has its photos already', () => {
  const viewer = makeViewer();
  const world = new World(viewer, { live: emptyState() });
  const photo = { image: 7, camera: 1, pose: [1, 0, 0, 0, 0, 0, 0] };
  const manifest = { photos: [photo], cameras: { 1: { width: 4, height: 3 } } };
  world.setManifest(2, manifest);
  assert.ok(world.join({ source: 2, target: 1, similarity: [1, 1, 0, 0, 0, 1, 0, 0] }, 10));
  world.setManifest(1, manifest);
  assert.deepEqual(world.takeJoined(10.1), []);
  world.place();
  assert.deepEqual(world.takeJoined(10.2), []);
  viewer.rest();
  assert.deepEqual(world.takeJoined(11.5), [2]);
});
