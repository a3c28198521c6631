// The mesh of a submap: triangles in chunks, in the submap's frame as it was when they were made. Pure functions.
import * as sim from './similarity.js';

const kHeaderBytes = 52;
const kVertexBytes = 9;
const kTriangleBytes = 6;
const kMaxVertices = 65536;
const kMaxTriangles = 262144;
const kEdgesSampled = 300;
const kGrowth = 1.25; // of the cell, while a chunk has too many triangles
const kTries = 12;

// The form of Shapes. A chunk's entry has `points`, its triangles, as the budget counts them. A prefix of a mesh is none,
// so chunks come whole and are made coarser.
export const kMesh = {
  manifestPath: (submap) => `/api/submaps/${submap}/mesh`,
  chunkPath: (submap, chunk) => `/api/submaps/${submap}/mesh/${chunk}`,
  checked: checkedMesh,
  dropsAbsent: true,
  isWhole: true,
  decode: (buffer, triangles) => {
    const whole = decodeMesh(buffer);
    return { ...coarsened(whole, triangles), points: Math.min(triangles, whole.triangles) };
  },
};

// {submap, version, chunks: [{id, version, points, frame: [{image, pose}]}]}, with one frame for all. Leaves out what is no pose
// or no chunk.
export function checkedMesh({ submap, version, frame, chunks }) {
  if (!Array.isArray(frame) || !Array.isArray(chunks)) throw new Error('not a mesh of a submap');
  const isPose = (p) => Array.isArray(p) && p.length === 7 && p.every(Number.isFinite);
  const poses = frame.filter((p) => Number.isInteger(p?.image) && isPose(p.pose)).map(({ image, pose }) => ({ image, pose }));
  const known = new Set();
  const list = [];
  for (const chunk of chunks) {
    if (!isChunk(chunk) || known.has(chunk.id)) continue;
    known.add(chunk.id);
    list.push({ id: chunk.id, version: chunk.version, points: chunk.triangles, frame: poses });
  }
  return { submap, version: Number(version) || 0, chunks: list };
}

const isChunk = (c) => Number.isSafeInteger(c?.id) && Number.isInteger(c.version) && Number.isInteger(c.triangles) && c.triangles > 0 && c.triangles <= kMaxTriangles;

// Throws on bytes that are no chunk of a mesh (services/web/README.md has the layout).
export function decodeMesh(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < kHeaderBytes || view.getUint32(0, false) !== 0x534b5431) throw new Error('not a chunk of a mesh');
  const vertices = view.getUint32(4, true);
  const triangles = view.getUint32(8, true);
  if (vertices > kMaxVertices || triangles > kMaxTriangles || buffer.byteLength !== kHeaderBytes + kVertexBytes * vertices + kTriangleBytes * triangles) {
    throw new Error(`a chunk of ${buffer.byteLength} bytes claims ${triangles} triangles`);
  }
  const origin = [12, 20, 28].map((at) => view.getFloat64(at, true));
  const step = view.getFloat64(36, true);
  if (!origin.every(Number.isFinite) || !(step > 0) || !Number.isFinite(step)) throw new Error('a chunk without a frame');
  // Four values a vertex: GPUs want vertices of a multiple of four bytes.
  const position = new Uint16Array(4 * vertices);
  const colour = new Uint8Array(4 * vertices);
  for (let i = 0, at = kHeaderBytes; i < vertices; ++i, at += kVertexBytes) {
    for (let k = 0; k < 3; ++k) {
      position[4 * i + k] = view.getUint16(at + 2 * k, true);
      colour[4 * i + k] = view.getUint8(at + 6 + k);
    }
  }
  const index = new Uint16Array(3 * triangles);
  for (let i = 0, at = kHeaderBytes + kVertexBytes * vertices; i < index.length; ++i, at += 2) {
    index[i] = view.getUint16(at, true);
    if (index[i] >= vertices) throw new Error('a triangle without a vertex');
  }
  return { version: Number(view.getBigUint64(44, true)), origin, step, vertices, triangles, position, colour, index };
}

// A chunk with at most about `triangles`: vertices within a cell of a grid become one (Rossignac and Borrel 1993). Its version
// is another one, as its vertices are. The chunk itself where it has no more.
export function coarsened(mesh, triangles) {
  if (mesh.triangles <= triangles) return mesh;
  let cell = edgeOf(mesh) * Math.sqrt(mesh.triangles / Math.max(1, triangles));
  let made = clustered(mesh, cell);
  for (let i = 0; made.triangles > triangles && i < kTries; ++i) made = clustered(mesh, (cell *= kGrowth));
  return { ...made, version: `${mesh.version}/${made.triangles}` };
}

// Mean length of edges, in steps.
function edgeOf({ position, index, triangles }) {
  const every = Math.max(1, Math.floor(triangles / kEdgesSampled));
  let sum = 0;
  let count = 0;
  for (let t = 0; t < triangles; t += every, ++count) {
    const [a, b] = [4 * index[3 * t], 4 * index[3 * t + 1]];
    sum += Math.hypot(position[a] - position[b], position[a + 1] - position[b + 1], position[a + 2] - position[b + 2]);
  }
  return Math.max(1, sum / count);
}

// Cells of `cell` steps. A vertex of the result is the mean of its cell's.
function clustered(mesh, cell) {
  const { position, colour, index, vertices } = mesh;
  const cells = new Map(); // key -> number
  const of = new Uint16Array(vertices);
  const sums = []; // x, y, z, r, g, b, count
  for (let i = 0; i < vertices; ++i) {
    const [x, y, z] = [0, 1, 2].map((k) => Math.floor(position[4 * i + k] / cell));
    const key = (x * 65536 + y) * 65536 + z;
    let number = cells.get(key);
    if (number === undefined) {
      number = cells.size;
      cells.set(key, number);
      sums.push([0, 0, 0, 0, 0, 0, 0]);
    }
    of[i] = number;
    const sum = sums[number];
    for (let k = 0; k < 3; ++k) {
      sum[k] += position[4 * i + k];
      sum[3 + k] += colour[4 * i + k];
    }
    sum[6]++;
  }
  const means = { position: new Uint16Array(4 * sums.length), colour: new Uint8Array(4 * sums.length) };
  sums.forEach((sum, n) => {
    for (let k = 0; k < 3; ++k) {
      means.position[4 * n + k] = Math.round(sum[k] / sum[6]);
      means.colour[4 * n + k] = Math.round(sum[3 + k] / sum[6]);
    }
  });
  const kept = [];
  for (let i = 0; i < index.length; i += 3) {
    const [a, b, c] = [of[index[i]], of[index[i + 1]], of[index[i + 2]]];
    if (a !== b && b !== c && c !== a) kept.push(a, b, c);
  }
  return { ...mesh, ...means, vertices: sums.length, triangles: kept.length / 3, index: Uint16Array.from(kept) };
}

// The submap's frame of now from that of a mesh: the similarity that moves the photos of `frame` to their places of now. Each
// photo tells its direction, too, so that photos on a line do. cameras: Map(image -> {centre, worldFromCam}). The identity with
// fewer than two photos that are still there.
export function framePlace(frame, cameras) {
  const common = frame.filter(({ image }) => cameras.has(image));
  const then = common.map(({ pose }) => sim.cameraPlace(pose));
  const now = common.map(({ image }) => cameras.get(image));
  const [reachThen, reachNow] = [then, now].map(reachOf);
  if (!(reachThen > 0) || !(reachNow > 0)) return sim.identity();
  return sim.fitSimilarity(now.flatMap((c) => cornersOf(c, reachNow)), then.flatMap((c) => cornersOf(c, reachThen))) ?? sim.identity();
}

const cornersOf = ({ centre, worldFromCam }, reach) =>
  [centre, ...[[reach, 0, 0], [0, reach, 0]].map((v) => sim.add(centre, sim.rotate(worldFromCam, v)))];

// Root mean square distance of cameras from their middle.
function reachOf(cameras) {
  const middle = sim.scaled(cameras.map((c) => c.centre).reduce(sim.add, [0, 0, 0]), 1 / cameras.length);
  return Math.sqrt(cameras.reduce((sum, c) => sum + sim.distance(c.centre, middle) ** 2, 0) / cameras.length);
}
