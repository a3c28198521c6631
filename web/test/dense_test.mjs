import assert from 'node:assert/strict';
import test from 'node:test';
import { decodeChunk, pointOf, prefixBytes, prefixOf } from '../src/chunk.js';
import { checkedDense, chunkPlace, discSize, kDense, photoPlaces, projectPoint, sampleSpacing } from '../src/dense.js';
import { emptyState } from '../src/fold.js';
import { Shapes } from '../src/shapes.js';
import * as sim from '../src/similarity.js';
import { World } from '../src/world.js';
import { denseAt, denseChunkBytes, depthPoints, makeSession, shapeAt } from '../test_server/synthetic.mjs';

const settle = async () => {
  for (let i = 0; i < 400; ++i) await null;
};

const photo = (image, chunks, scale = 1) => ({ image, scale, share: 0.5, chunks });

function bufferOf(points) {
  const view = new DataView(new ArrayBuffer(prefixBytes(points)));
  view.setUint32(0, 0x534b4331);
  view.setUint32(4, points, true);
  view.setFloat64(32, 1, true);
  view.setBigUint64(40, 1n, true);
  return view.buffer;
}

// A server with the surface of one submap, and a page that follows it.
function server(photos, { follows = true, budget = 100000 } = {}) {
  const world = {
    photos, version: 1, absent: false, requests: [], shown: new Map(), gone: [], cuts: [], timers: [], poses: new Set(photos.map((p) => p.image)),
  };
  const fetch = async (path, { headers } = {}) => {
    world.requests.push(path);
    const part = /dense\/(\d+)\?v=(\d+)/.exec(path);
    if (!part) {
      if (world.absent) return { ok: false, status: 404 };
      return { ok: true, json: async () => ({ submap: 1, version: world.version, photos: world.photos }) };
    }
    if (world.broken) throw new Error('lost');
    const chunk = world.photos.flatMap((p) => p.chunks).find((c) => c.id === Number(part[1]));
    if (chunk?.version !== Number(part[2])) return { ok: false, status: 404, json: async () => ({ error: 'gone', version: chunk?.version }) };
    const end = /bytes=0-(\d+)/.exec(headers?.Range ?? '');
    const buffer = bufferOf(chunk.points);
    return { ok: true, arrayBuffer: async () => (end ? buffer.slice(0, Number(end[1]) + 1) : buffer) };
  };
  world.shapes = new Shapes({
    manifest: () => {}, chunk: (_, id, chunk, { image }) => world.shown.set(id, [image, chunk.points]), chunkGone: (_, id) => world.shown.delete(id),
    chunkCut: (_, id, points) => world.cuts.push([id, points]), gone: (id) => world.gone.push(id),
  }, { fetch, setTimeout: (f) => world.timers.push(f), budget, follows, form: kDense, wants: (_, { image }) => world.poses.has(image) });
  return world;
}

test('A manifest is believed within bounds', () => {
  const chunk = { id: 1, version: 3, points: 10 };
  const dense = checkedDense({
    submap: 1, version: 7, photos: [
      photo(5, [chunk, { id: 2, version: 1, points: 20 }, { id: 3, version: 1, points: 16385 }, { id: 4, version: 1, points: 0 }, null]),
      photo(5, [{ id: 9, version: 1, points: 1 }]), // twice
      photo(6, [{ id: 1, version: 8, points: 5 }]), // another photo's chunk
      photo(7, [], 0), photo(8, [], NaN), photo(9, [], '1e3x'), { image: 'x', scale: 1 }, null,
      { image: 10, scale: 2, share: 40 },
    ],
  });
  assert.deepEqual(dense.chunks, [{ ...chunk, image: 5 }, { id: 2, version: 1, points: 20, image: 5 }]);
  assert.deepEqual([...dense.photos], [
    [5, { scale: 1, share: 0.5, points: 30 }], [6, { scale: 1, share: 0.5, points: 0 }], [10, { scale: 2, share: 1, points: 0 }],
  ]);
  assert.equal(dense.version, 7);
  for (const other of [{}, { photos: {} }, null]) assert.throws(() => checkedDense(other));
});

test('X_submap = R^T (scale x - t); a photo without a pose, or that is not shown, has no place', () => {
  const pose = [...sim.normalized([0.7, 0.1, -0.5, 0.2]), 3, -1, 2];
  const camera = { ...sim.cameraPlace(pose), aspect: [0.6, 0.45] };
  const dense = checkedDense({ version: 1, photos: [photo(1, [], 2.5), photo(2, [], 1), photo(3, [], 1)] });
  const cameras = new Map([[1, camera], [3, camera]]);
  assert.deepEqual([...photoPlaces(dense, cameras).keys()], [1, 3]);
  const places = photoPlaces(dense, cameras, (image) => image === 1);
  assert.deepEqual([...places.keys()], [1]);
  const chunk = { origin: [0.5, -1, 4], step: 0.001, position: new Uint16Array([100, 2000, 65535, 0]) };
  const { place } = places.get(1);
  const x = pointOf(chunk, 0);
  const wanted = sim.rotate(sim.conjugate(pose.slice(0, 4)), sim.subtract(sim.scaled(x, 2.5), pose.slice(4)));
  for (const got of [sim.apply(place, x), sim.apply(chunkPlace(place, chunk), [100, 2000, 65535])]) {
    assert.ok(sim.distance(got, wanted) < 1e-9, `${got} of ${wanted}`);
  }
  const seen = projectPoint(pose, { fx: 1000, fy: 900, cx: 640, cy: 480 }, wanted);
  assert.ok(Math.abs(seen[0] - (1000 * x[0] / x[2] + 640)) < 1e-6 && Math.abs(seen[1] - (900 * x[1] / x[2] + 480)) < 1e-6);
  assert.equal(projectPoint(pose, { fx: 1, fy: 1, cx: 0, cy: 0 }, sim.apply(place, [0, 0, -1])), null);
});

test('The discs of a whole depth map touch; those of a sample are larger', () => {
  // 400 x 300 px of which a quarter has a depth: a pixel is 1 / focal wide at depth 1.
  const [focal, tanX, tanY] = [320, 200 / 320, 150 / 320];
  const spacing = sampleSpacing({ points: 30000, share: 0.25 }, [tanX, tanY]);
  assert.ok(Math.abs(spacing - 1 / focal) < 1e-12);
  assert.ok(Math.abs(discSize(spacing, 10, 10) - Math.SQRT2 / focal) < 1e-12);
  assert.ok(Math.abs(discSize(spacing, 10, 40) - 2 * discSize(spacing, 10, 10)) < 1e-12);
  assert.deepEqual([sampleSpacing({ points: 0, share: 1 }, [1, 1]), discSize(1, 0, 5)], [0, 0]);
});

test('The surface of a photo lies where its map has it, whatever the unit of its depths', () => {
  const session = makeSession({ photosEach: 6, numPoints: 4000 });
  const mapOf = (p) => depthPoints(session, p, 60);
  const shape = shapeAt(session, 1, Infinity);
  const dense = checkedDense(denseAt(session, 1, Infinity, mapOf));
  const cameras = new Map(shape.manifest.photos.map((p) => [p.image, { ...sim.cameraPlace(p.pose), aspect: [0.6, 0.45] }]));
  const places = photoPlaces(dense, cameras);
  const scales = new Set([...dense.photos.values()].map((p) => p.scale));
  assert.ok(dense.photos.size > 4 && scales.size > 1);
  const world = session.points.map((p) => sim.apply(shape.frame, p.xyz));
  for (const { id, image } of dense.chunks.slice(0, 4)) {
    const bytes = denseChunkBytes(mapOf(session.photos[image - 1]), id);
    const chunk = decodeChunk(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
    for (let i = 0; i < chunk.points; i += 97) {
      const own = sim.apply(places.get(image).place, pointOf(chunk, i));
      const off = Math.min(...world.map((p) => sim.distance(p, own))) / shape.frame.s;
      assert.ok(off < 1, `${off} m`);
    }
  }
});

test('While the surface is not shown nothing is asked for; what was announced is known', async () => {
  const world = server([photo(1, [{ id: 1, version: 1, points: 10 }])], { follows: false });
  world.shapes.announce(1, 1);
  world.shapes.setBudget(5000);
  await settle();
  assert.deepEqual([world.requests, [...world.shapes.submaps.keys()]], [[], [1]]);
  world.shapes.follow(true);
  await settle();
  assert.deepEqual(world.requests, ['/api/submaps/1/dense', '/api/submaps/1/dense/1?v=1']);
  assert.deepEqual([...world.shown], [[1, [1, 10]]]);
  world.shapes.follow(false);
  world.photos.push(photo(2, [{ id: 2, version: 1, points: 4 }]));
  world.poses.add(2);
  world.shapes.announce(1, 2);
  world.version = 2;
  await settle();
  assert.equal(world.requests.length, 2);
  assert.equal(world.shown.size, 1, 'what was loaded stays');
  world.shapes.follow(true);
  await settle();
  assert.deepEqual(world.requests.slice(2), ['/api/submaps/1/dense', '/api/submaps/1/dense/2?v=1']);
});

test('A retry that is due while the surface is not shown asks for nothing, and is made up for', async () => {
  const world = server([photo(1, [{ id: 1, version: 1, points: 10 }])]);
  world.broken = true;
  world.shapes.announce(1, 1);
  await settle();
  const asked = world.requests.length;
  world.shapes.follow(false);
  for (const f of world.timers.splice(0)) f();
  await settle();
  assert.equal(world.requests.length, asked);
  world.broken = false;
  world.shapes.follow(true);
  await settle();
  assert.deepEqual([...world.shown], [[1, [1, 10]]]);
});

test('A chunk whose version is gone is had as the newer one', async () => {
  const world = server([photo(4, [{ id: 7, version: 1, points: 10 }])]);
  const { fetch } = world.shapes;
  world.shapes.fetch = async (path, options) => {
    const answer = await fetch(path, options);
    if (path.endsWith('dense')) {
      const told = structuredClone(world.photos);
      world.photos[0].chunks[0].version = 2;
      return { ok: true, json: async () => ({ version: 1, photos: told }) };
    }
    return answer;
  };
  world.shapes.announce(1, 1);
  await settle();
  assert.deepEqual(world.requests, ['/api/submaps/1/dense', '/api/submaps/1/dense/7?v=1', '/api/submaps/1/dense/7?v=2']);
  assert.deepEqual([...world.shown], [[7, [4, 10]]]);
});

test('Chunks of photos without a pose are not asked for, and have no part in the budget', async () => {
  const world = server([photo(1, [{ id: 1, version: 1, points: 8000 }]), photo(2, [{ id: 2, version: 1, points: 8000 }])], { budget: 8000 });
  world.poses.delete(2);
  world.shapes.announce(1, 1);
  await settle();
  assert.deepEqual([...world.shown], [[1, [1, 8000]]]);
  world.poses.add(2);
  world.shapes.pump(); // as a manifest of the shape comes
  await settle();
  assert.deepEqual(world.shown.get(2), [2, 4000]);
});

test('What was loaded of the first photos is cut when there are many', async () => {
  const world = server([photo(1, [{ id: 1, version: 1, points: 9000 }])], { budget: 9000 });
  world.shapes.announce(1, 1);
  await settle();
  for (const image of [2, 3]) {
    world.photos.push(photo(image, [{ id: image, version: 1, points: 9000 }]));
    world.poses.add(image);
  }
  world.version = 2;
  world.shapes.announce(1, 2);
  await settle();
  assert.deepEqual(world.cuts, [[1, 3000]]);
  assert.deepEqual([...world.shown.values()].map(([, points]) => points), [9000, 3000, 3000]);
  assert.equal(world.requests.filter((path) => path.includes('dense/1?')).length, 1, 'what is cut is not asked for again');
});

test('A prefix of a chunk has its first points', () => {
  const chunk = decodeChunk(bufferOf(9));
  chunk.position.forEach((_, i) => (chunk.position[i] = i));
  const { points, total, position, colour, hasRanks } = prefixOf({ ...chunk, hasRanks: true }, 2);
  assert.deepEqual([points, total, [...position], colour.length, hasRanks], [2, 9, [0, 1, 2, 3, 4, 5, 6, 7], 8, undefined]);
});

test('After a new connection a surface that is no more goes', async () => {
  for (const follows of [true, false]) {
    const world = server([photo(1, [{ id: 1, version: 1, points: 10 }])], { follows });
    world.shapes.announce(1, 1);
    await settle();
    world.absent = true;
    world.shapes.doubt();
    await settle();
    assert.deepEqual([world.gone, world.shapes.submaps.size], [[1], 0]);
  }
});

test('What a submap lost with its shape is loaded anew', async () => {
  const world = server([photo(1, [{ id: 1, version: 1, points: 10 }])]);
  world.shapes.announce(1, 1);
  await settle();
  world.shown.clear();
  world.shapes.again(1);
  world.shapes.again(2); // there is none
  await settle();
  assert.deepEqual([world.gone, [...world.shown.keys()]], [[1], [1]]);
});

// A viewer that keeps the places of photos.
function makeWorld() {
  const places = new Map();
  const submaps = {
    setPhotos: (id, photos) => places.set(id, [...photos.keys()]), dropSurface: (id) => places.delete(id), placeMesh: () => {}, goalOf: () => null, drop: () => {},
  };
  const live = emptyState();
  for (const [image, firstPlaced] of [[1, 100], [2, 200], [3, 0]]) live.photos.set(image, { firstPlaced });
  const timeline = { live, utime: null, get isLive() { return this.utime === null; } };
  return { world: new World({ submaps }, timeline), timeline, places };
}
const poseAt = (x) => [1, 0, 0, 0, x, 0, 0];
const lens = { width: 400, height: 300, fx: 300, fy: 300, cx: 200, cy: 150 };
const shapeOf = (...images) => ({ photos: images.map((image) => ({ image, camera: 1, pose: poseAt(image) })), cameras: { 1: lens }, chunks: [] });

test('Photos are placed as a shape or a surface comes, and only those that the shape has', () => {
  const { world, places } = makeWorld();
  world.setDense(7, checkedDense({ version: 1, photos: [photo(1, []), photo(2, [])] }));
  assert.equal(places.has(7), false);
  world.setManifest(7, shapeOf(1));
  assert.deepEqual(places.get(7), [1]);
  assert.deepEqual([world.hasPose(7, 1), world.hasPose(7, 2), world.hasPose(8, 1)], [true, false, false]);
  world.setManifest(7, shapeOf(1, 2));
  assert.deepEqual(places.get(7), [1, 2]);
  world.setDense(7, checkedDense({ version: 2, photos: [photo(2, [])] }));
  assert.deepEqual(places.get(7), [2]);
  world.dropDense(7);
  assert.equal(places.has(7), false);
});

test('At an earlier time only the surfaces of photos that were placed by then are shown', () => {
  const { world, timeline, places } = makeWorld();
  world.setManifest(7, shapeOf(1, 2, 3));
  world.setDense(7, checkedDense({ version: 1, photos: [photo(1, []), photo(2, []), photo(3, [])] }));
  assert.deepEqual(places.get(7), [1, 2, 3]);
  for (const [utime, wanted] of [[50, []], [150, [1]], [200, [1, 2]], [null, [1, 2, 3]]]) {
    timeline.utime = utime;
    world.showSurfaces();
    assert.deepEqual(places.get(7), wanted);
  }
});

test('A point of the surface tells where its photo has it', () => {
  const { world } = makeWorld();
  world.setManifest(7, shapeOf(1));
  assert.deepEqual(world.sightingsOf(7, 1, [1, 1, 2]), [{ image: 1, x: 500, y: 300 }]);
  assert.deepEqual(world.sightingsOf(7, 1, [1, 1, -2]), []);
  assert.deepEqual(world.sightingsOf(7, 2, [1, 1, 2]), []);
});
