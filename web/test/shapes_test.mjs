import assert from 'node:assert/strict';
import test from 'node:test';
import { decodeChunk, pointOf, prefixBytes } from '../src/chunk.js';
import { Shapes } from '../src/shapes.js';
import { chunkBytes, makeSession, shapeAt } from '../test_server/synthetic.mjs';
import * as sim from '../src/similarity.js';

const settle = async () => {
  for (let i = 0; i < 400; ++i) await null;
};

function bufferOf(points, version) {
  const view = new DataView(new ArrayBuffer(prefixBytes(points)));
  view.setUint32(0, 0x534b4331);
  view.setUint32(4, points, true);
  view.setFloat64(32, 1, true);
  view.setBigUint64(40, BigInt(version), true);
  return view.buffer;
}

// A server with one submap.
function server(chunks) {
  const world = { chunks, version: 1, requests: [], shown: new Map(), gone: [], alone: false, timers: [], most: 0, active: 0, waiting: [] };
  const fetch = async (path, options = {}) => {
    world.requests.push([path, options.headers?.Range ?? '']);
    const part = /chunks\/(\d+)\?v=(\d+)/.exec(path);
    if (!part) {
      await world.held;
      if (world.absent) return { ok: false, status: 404 };
      return { ok: true, json: async () => ({ submap: 1, version: world.version, photos: [], cameras: {}, chunks: world.chunks.map((c) => ({ ...c })) }) };
    }
    world.most = Math.max(world.most, ++world.active);
    await null;
    world.active--;
    if (world.broken) throw new Error('lost');
    const chunk = world.chunks.find((c) => c.id === Number(part[1]));
    if (!chunk) return { ok: false, status: 404, json: async () => ({ error: 'gone' }) };
    if (chunk.version !== Number(part[2])) return { ok: false, status: 404, json: async () => ({ version: chunk.version }) };
    const end = /bytes=0-(\d+)/.exec(options.headers?.Range ?? '');
    const buffer = bufferOf(chunk.points, chunk.version);
    return { ok: true, arrayBuffer: async () => (end ? buffer.slice(0, Number(end[1]) + 1) : buffer) };
  };
  world.shapes = new Shapes({
    manifest: () => {}, chunk: (_, id, chunk) => world.shown.set(id, chunk), gone: (id) => world.gone.push(id),
    chunkGone: (_, id) => world.shown.delete(id),
  }, { fetch, setTimeout: (f) => world.timers.push(f), budget: 10000 });
  return world;
}

test('Only chunks whose version rose are fetched again, a few at a time', async () => {
  const world = server([1, 2, 3, 4, 5, 6].map((id) => ({ id, version: 1, points: 10 })));
  world.shapes.announce(1, 1);
  await settle();
  assert.equal(world.shown.size, 6);
  assert.ok(world.most <= 4);
  world.requests.length = 0;
  world.version = 2;
  world.chunks[3].version = 2;
  world.shapes.announce(1, 2);
  await settle();
  assert.deepEqual(world.requests.map(([p]) => p), ['/api/submaps/1', '/api/submaps/1/chunks/4?v=2']);
  world.shapes.announce(1, 2);
  await settle();
  assert.equal(world.requests.length, 2);
});

test('A version that is gone leads to the newest one; a lost chunk is asked for again', async () => {
  const world = server([{ id: 1, version: 5, points: 3 }]);
  world.shapes.announce(1, 1);
  world.chunks = [{ id: 1, version: 5, points: 3 }];
  await settle();
  world.chunks[0].version = 6;
  world.shapes.announce(1, 9);
  const manifestOf5 = world.chunks;
  world.chunks = manifestOf5.map((c) => ({ ...c, version: 7 }));
  await settle();
  assert.equal(world.shown.get(1).version, 7);
  world.broken = true;
  world.version = 10;
  world.chunks[0].version = 8;
  world.shapes.announce(1, 10);
  await settle();
  assert.equal(world.shown.get(1).version, 7);
  world.broken = false;
  for (const f of world.timers.splice(0)) f();
  await settle();
  assert.equal(world.shown.get(1).version, 8);
});

// Of a session's last shape no other one tells that a chunk is missing.
test('A chunk that is lost while a manifest takes longer than the retry is asked for again with that manifest', async () => {
  const world = server([{ id: 1, version: 1, points: 3 }]);
  world.broken = true;
  world.shapes.announce(1, 1);
  while (world.active === 0) await null;
  let release = null;
  world.held = new Promise((resolve) => (release = resolve));
  world.version = 2;
  world.shapes.announce(1, 2);
  await settle();
  for (const f of world.timers.splice(0)) f();
  world.broken = false;
  release();
  await settle();
  assert.deepEqual([...world.shown.keys()], [1]);
});

// skein-web began anew, and has the newest model's shape until the mapper tells its own.
test('An older shape than was told before is taken, once, and all its chunks', async () => {
  const world = server([{ id: 1, version: 50, points: 10 }, { id: 2, version: 40, points: 10 }]);
  world.version = 50;
  world.shapes.announce(1, 50);
  await settle();
  world.version = 30;
  world.chunks = [{ id: 1, version: 30, points: 20 }, { id: 2, version: 30, points: 5 }];
  world.requests.length = 0;
  world.shapes.announce(1);
  await settle();
  assert.deepEqual([...world.shown.values()].map((c) => c.points), [20, 5]);
  assert.deepEqual(world.requests.map(([p]) => p), ['/api/submaps/1', '/api/submaps/1/chunks/1?v=30', '/api/submaps/1/chunks/2?v=30']);
  world.version = 60;
  world.chunks = [{ id: 1, version: 60, points: 11 }, { id: 2, version: 20, points: 10 }];
  world.shapes.announce(1, 60);
  await settle();
  assert.deepEqual([...world.shown.values()].map((c) => c.points), [11, 10]);
});

test('Chunks that the shape has no more go when the others are there', async () => {
  const world = server([{ id: 1, version: 1, points: 3 }, { id: 2, version: 1, points: 3 }]);
  world.shapes.announce(1, 1);
  await settle();
  world.version = 2;
  world.chunks = [{ id: 3, version: 2, points: 6 }];
  world.broken = true;
  world.shapes.announce(1, 2);
  await settle();
  assert.deepEqual([...world.shown.keys()], [1, 2]);
  world.broken = false;
  for (const f of world.timers.splice(0)) f();
  await settle();
  assert.deepEqual([...world.shown.keys()], [3]);
});

test('Above the budget only a prefix of each chunk is loaded, and the rest when the budget grows', async () => {
  const world = server([{ id: 1, version: 1, points: 8000 }, { id: 2, version: 1, points: 8000 }]);
  world.shapes.setBudget(4000);
  world.shapes.announce(1, 1);
  await settle();
  assert.deepEqual([...world.shown.values()].map((c) => [c.points, c.total]), [[2000, 8000], [2000, 8000]]);
  world.shapes.setBudget(20000);
  await settle();
  assert.deepEqual([...world.shown.values()].map((c) => c.points), [8000, 8000]);
});

test('A submap without a shape waits to be told; one that is gone is dropped', async () => {
  const world = server([{ id: 1, version: 1, points: 3 }]);
  world.absent = true;
  world.shapes.announce(1);
  await settle();
  assert.equal(world.timers.length, 0);
  world.absent = false;
  world.shapes.announce(1, 1);
  await settle();
  assert.equal(world.shown.size, 1);
  world.shapes.drop(1);
  assert.deepEqual(world.gone, [1]);
});

test('Positions of a chunk are within half a step; a prefix is a chunk; other bytes are refused', () => {
  const session = makeSession({ photosEach: 6, numPoints: 2000 });
  const shape = shapeAt(session, 1, Infinity);
  const bytes = chunkBytes(session, shape, shape.chunks[0]);
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
  const chunk = decodeChunk(buffer);
  assert.equal(chunk.points, shape.chunks[0].part.length);
  shape.chunks[0].part.slice(0, 50).forEach(([i], n) => {
    const wanted = sim.apply(shape.frame, session.points[i].xyz);
    const error = Math.max(...pointOf(chunk, n).map((v, k) => Math.abs(v - wanted[k])));
    assert.ok(error <= 0.5001 * chunk.step, `${error} of ${chunk.step}`);
  });
  const prefix = decodeChunk(buffer.slice(0, prefixBytes(7) + 3));
  assert.deepEqual([prefix.points, prefix.total], [7, chunk.points]);
  assert.deepEqual([...prefix.position], [...chunk.position.slice(0, 28)]);
  assert.throws(() => decodeChunk(new ArrayBuffer(20)));
  assert.throws(() => decodeChunk(new ArrayBuffer(200)));
  assert.throws(() => decodeChunk(bufferOf(20000, 1)));
});
