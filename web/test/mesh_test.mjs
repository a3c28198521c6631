import assert from 'node:assert/strict';
import test from 'node:test';
import { pointOf } from '../src/chunk.js';
import { checkedMesh, coarsened, decodeMesh, framePlace, kMesh } from '../src/mesh.js';
import { Shapes } from '../src/shapes.js';
import * as sim from '../src/similarity.js';
import { encodeMesh, makeSession, meshAt, meshChunkBytes, shapeAt } from '../test_server/synthetic.mjs';

const settle = async () => {
  for (let i = 0; i < 400; ++i) await null;
};
const bufferOf = (bytes) => bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);

// A square of n x n vertices in a plane.
function plane(n) {
  const vertices = [];
  const triangles = [];
  for (let v = 0; v < n; ++v) for (let u = 0; u < n; ++u) vertices.push([u, v, 5]);
  for (let v = 0; v + 1 < n; ++v) {
    for (let u = 0; u + 1 < n; ++u) {
      const a = v * n + u;
      triangles.push([a, a + 1, a + n + 1], [a, a + n + 1, a + n]);
    }
  }
  return bufferOf(encodeMesh(vertices, triangles, [10, 20, 30], 7));
}

const areaOf = (mesh) => {
  let sum = 0;
  for (let i = 0; i < mesh.index.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => pointOf(mesh, mesh.index[i + k]));
    sum += Math.hypot(...sim.cross(sim.subtract(b, a), sim.subtract(c, a))) / 2;
  }
  return sum;
};

test('A list is believed within bounds', () => {
  const pose = [1, 0, 0, 0, 1, 2, 3];
  const chunk = { id: 1, version: 3, triangles: 10 };
  const mesh = checkedMesh({
    submap: 1, version: 7, frame: [{ image: 5, pose }, { image: 6, pose: [1, 2] }, { image: 'x', pose }, null],
    chunks: [chunk, { ...chunk, version: 4 }, { id: 2, version: 1, triangles: 262145 }, { id: 3, version: 1, triangles: 0 }, { id: 2 ** 60, version: 1, triangles: 1 }, null],
  });
  assert.deepEqual(mesh, { submap: 1, version: 7, chunks: [{ id: 1, version: 3, points: 10, frame: [{ image: 5, pose }] }] });
  for (const other of [{}, { frame: [] }, { frame: {}, chunks: [] }]) assert.throws(() => checkedMesh(other));
});

test('A chunk has its vertices, colours and triangles', () => {
  const mesh = decodeMesh(plane(3));
  assert.deepEqual([mesh.vertices, mesh.triangles, mesh.version], [9, 8, 7]);
  assert.ok(sim.distance(pointOf(mesh, 5), [2, 1, 5]) < 1e-4);
  assert.deepEqual([...mesh.colour.slice(0, 3)], [10, 20, 30]);
  assert.ok(Math.abs(areaOf(mesh) - 4) < 1e-3);
});

test('Bytes that are no chunk are refused', () => {
  const good = plane(3);
  const changed = (change) => {
    const copy = good.slice(0);
    change(new DataView(copy));
    return copy;
  };
  const bad = [
    new ArrayBuffer(0), good.slice(0, 51), good.slice(0, good.byteLength - 1), changed((v) => v.setUint32(0, 1)),
    changed((v) => v.setUint32(8, 0xffffffff, true)), changed((v) => v.setUint32(4, 0xffffffff, true)), changed((v) => v.setFloat64(36, 0, true)),
    changed((v) => v.setFloat64(12, NaN, true)), changed((v) => v.setUint16(good.byteLength - 2, 9, true)),
  ];
  for (const bytes of bad) assert.throws(() => decodeMesh(bytes));
});

test('A coarser chunk has fewer triangles and about the same area', () => {
  const mesh = decodeMesh(plane(60));
  const coarse = coarsened(mesh, 700);
  assert.ok(coarse.triangles <= 700 && coarse.triangles > 200, `${coarse.triangles}`);
  assert.ok(areaOf(coarse) > 0.8 * areaOf(mesh));
  assert.ok(coarse.index.every((i) => i < coarse.vertices));
  assert.notEqual(coarse.version, mesh.version);
  assert.deepEqual([...coarse.colour.slice(0, 3)], [10, 20, 30]);
  assert.equal(coarsened(mesh, mesh.triangles), mesh);
});

test('The mesh goes with the photos of its frame, also where they stand on a line', () => {
  const moved = { s: 2.5, q: sim.normalized([0.8, 0.1, -0.5, 0.2]), t: [3, -1, 2] };
  const frame = [0, 1, 2].map((i) => ({ image: i + 1, pose: [...sim.normalized([1, 0.1 * i, 0.2, 0]), 0, 0, 0] }));
  frame.forEach((photo, i) => {
    const q = photo.pose.slice(0, 4);
    photo.pose.splice(4, 3, ...sim.scaled(sim.rotate(q, [2 * i, 0, 0]), -1));
  });
  const cameras = new Map(frame.map(({ image, pose }) => {
    const { centre, worldFromCam } = sim.cameraPlace(pose);
    return [image, { centre: sim.apply(moved, centre), worldFromCam: sim.multiply(moved.q, worldFromCam) }];
  }));
  const place = framePlace(frame, cameras);
  for (const point of [[0, 0, 0], [1, 5, -3]]) assert.ok(sim.distance(sim.apply(place, point), sim.apply(moved, point)) < 1e-6);
  cameras.delete(1);
  assert.ok(sim.distance(sim.apply(framePlace(frame, cameras), [1, 5, -3]), sim.apply(moved, [1, 5, -3])) < 1e-6, 'two are enough');
  cameras.delete(2);
  assert.deepEqual(framePlace(frame, cameras), sim.identity());
});

test('Chunks come whole, and as coarse as the budget wants', async () => {
  const shown = new Map();
  const ranges = [];
  const list = [1, 2].map((id) => ({ id, version: 1, triangles: 2 * 59 * 59 }));
  const shapes = new Shapes({
    manifest: () => {}, chunk: (_, id, chunk, { frame }) => shown.set(id, [chunk.triangles, frame.length]), chunkGone: (_, id) => shown.delete(id), gone: () => {},
  }, {
    fetch: async (path, { headers } = {}) => {
      if (headers?.Range) ranges.push(path);
      if (path === '/api/submaps/1/mesh') return { ok: true, json: async () => ({ submap: 1, version: 3, frame: [{ image: 1, pose: [1, 0, 0, 0, 0, 0, 0] }], chunks: list }) };
      return { ok: true, arrayBuffer: async () => plane(60) };
    },
    setTimeout: () => {}, form: kMesh, budget: 3000,
  });
  shapes.announce(1, 3);
  await settle();
  assert.deepEqual(ranges, []);
  assert.equal(shown.size, 2);
  for (const [triangles, frame] of shown.values()) assert.ok(triangles <= 1500 && triangles > 300 && frame === 1, `${triangles}`);
});

test('The test server’s mesh lies before its photos', () => {
  const session = makeSession({ photosEach: 6, numPoints: 4000 });
  const mesh = checkedMesh(meshAt(session, 1, Infinity));
  const { manifest, frame } = shapeAt(session, 1, Infinity);
  const [{ image, pose }] = manifest.photos;
  const chunk = decodeMesh(bufferOf(meshChunkBytes(session, session.photos[image - 1], pose, frame.s, 1)));
  assert.equal(mesh.chunks.find((c) => c.id === image).points, chunk.triangles);
  const { centre, worldFromCam } = sim.cameraPlace(pose);
  const inCamera = sim.rotate(sim.conjugate(worldFromCam), sim.subtract(pointOf(chunk, 0), centre));
  assert.ok(inCamera[2] > 0);
});
