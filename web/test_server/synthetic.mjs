// A session that never was: two agents photograph a house from both ends of a street, in a map each, until their photos
// overlap and the maps are joined. Everything that the page can show occurs. Deterministic.
import { kMaxChunkPoints } from '../src/chunk.js';
import * as sim from '../src/similarity.js';

export function randomOf(seed) {
  let a = seed >>> 0;
  return () => {
    a = (a + 0x6d2b79f5) >>> 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const kFinishUs = 120e6; // until the finish would be cut
const kWidth = 1600;
const kHeight = 1200;
const kFocal = 1300;

// Points with colours on walls, roof, ground and trees. World frame: metres, z up, y north.
function makePoints(random, n) {
  const points = [];
  const shaded = (c, f) => c.map((v) => Math.max(0, Math.min(255, Math.round(v * f + 14 * (random() - 0.5)))));
  const addPoint = (x, y, z, c, f) => points.push({ xyz: [x, y, z], colour: shaded(c, f) });
  const wall = (x0, y0, x1, y1, height, colour, light, count) => {
    const width = Math.hypot(x1 - x0, y1 - y0);
    for (let i = 0; i < count; ++i) {
      const u = random();
      const z = height * random();
      const inWindow = (u * width) % 2.6 > 0.8 && (u * width) % 2.6 < 1.9 && z % 3 > 1 && z % 3 < 2.4;
      const depth = inWindow ? 0.12 : 0;
      const nx = (y1 - y0) / width;
      const ny = -(x1 - x0) / width;
      const brick = Math.floor(z * 6) % 2 === 0 ? 1 : 0.93;
      addPoint(x0 + u * (x1 - x0) - nx * depth, y0 + u * (y1 - y0) - ny * depth, z, inWindow ? [58, 74, 92] : colour, light * brick);
    }
  };
  const share = n / 100;
  const houses = [[-14, 6, 11, 8, 6.2, [196, 122, 92]], [0, 7, 10, 7, 8.8, [214, 196, 160]], [13, 6, 12, 8, 6, [170, 176, 182]]];
  for (const [cx, cy, w, d, z, colour] of houses) {
    const [x0, x1, y0, y1] = [cx - w / 2, cx + w / 2, cy, cy + d];
    wall(x0, y0, x1, y0, z, colour, 1.0, share * 15);
    wall(x1, y0, x1, y1, z, colour, 0.72, share * 3);
    wall(x0, y1, x0, y0, z, colour, 0.82, share * 3);
    for (let i = 0; i < share * 4; ++i) {
      const u = random();
      const v = random();
      addPoint(x0 + u * w, y0 - 0.4 + v * (d / 2 + 0.4), z + v * 2.4, [128, 62, 52], 0.9 + 0.1 * Math.sin(40 * v));
    }
    for (let i = 0; i < share * 0.6; ++i) addPoint(cx - 0.6 + 1.2 * random(), y0 - 0.05, 2.2 * random(), [62, 92, 70], 1);
  }
  for (let i = 0; i < share * 17; ++i) {
    const x = -24 + 48 * random();
    const y = -9 + 15 * random();
    const road = y < -1.5;
    addPoint(x, y, 0.03 * random() - (road ? 0.12 : 0), road ? [96, 98, 102] : y < 1.5 ? [158, 152, 144] : [92, 124, 66], 1);
  }
  for (const [tx, ty, r] of [[-6.8, 2.4, 1.5], [7.2, 2.2, 1.7], [20, 2.6, 1.4]]) {
    for (let i = 0; i < share * 2; ++i) {
      const a = 2 * Math.PI * random();
      const b = Math.acos(2 * random() - 1);
      const rr = r * (0.75 + 0.25 * random());
      addPoint(tx + rr * Math.sin(b) * Math.cos(a), ty + rr * Math.sin(b) * Math.sin(a), 3.4 + rr * Math.cos(b), [70, 112, 52], 0.7 + 0.4 * random());
    }
    for (let i = 0; i < share * 0.3; ++i) addPoint(tx + 0.3 * (random() - 0.5), ty + 0.3 * (random() - 0.5), 2.4 * random(), [90, 70, 52], 1);
  }
  return points;
}

// world_from_cam looking from `eye` to `at`, the camera's y axis down.
function lookAt(eye, at) {
  const z = sim.unit(sim.subtract(at, eye));
  const x = sim.unit(sim.cross(z, [0, 0, 1]));
  const y = sim.cross(z, x);
  const [m00, m10, m20] = x;
  const [m01, m11, m21] = y;
  const [m02, m12, m22] = z;
  const w = Math.sqrt(Math.max(0, 1 + m00 + m11 + m22)) / 2;
  const qx = (Math.sqrt(Math.max(0, 1 + m00 - m11 - m22)) / 2) * Math.sign(m21 - m12 || 1);
  const qy = (Math.sqrt(Math.max(0, 1 - m00 + m11 - m22)) / 2) * Math.sign(m02 - m20 || 1);
  const qz = (Math.sqrt(Math.max(0, 1 - m00 - m11 + m22)) / 2) * Math.sign(m10 - m01 || 1);
  return sim.normalized([w, qx, qy, qz]);
}

function projectTo(photo, xyz) {
  const c = sim.rotate(sim.conjugate(photo.worldFromCam), sim.subtract(xyz, photo.centre));
  if (c[2] < 0.5) return null;
  const x = (kFocal * c[0]) / c[2] + kWidth / 2;
  const y = (kFocal * c[1]) / c[2] + kHeight / 2;
  return x >= 0 && y >= 0 && x < kWidth && y < kHeight ? [x, y, c[2]] : null;
}

// Poses of a camera at another frame: cam_from_frame of frame_from_world.
function poseIn(frameFromWorld, photo) {
  const centre = sim.apply(frameFromWorld, photo.centre);
  const camFromFrame = sim.conjugate(sim.multiply(frameFromWorld.q, photo.worldFromCam));
  return [...camFromFrame, ...sim.scaled(sim.rotate(camFromFrame, centre), -1)];
}

export function makeSession({ photosEach = 24, numPoints = 30000, seed = 1, startUtime = 1_790_000_000_000_000, gps = false } = {}) {
  const random = randomOf(seed);
  const points = makePoints(random, numPoints);
  const photos = [];
  const events = [];
  const add = (t, kind, fields) => events.push({ t: Math.round(t), kind, ...fields });
  const frames = {
    1: { s: 0.21, q: sim.normalized([0.7, 0.62, -0.1, 0.3]), t: [1, -2, 5] },
    2: { s: 0.34, q: sim.normalized([0.2, -0.5, 0.7, 0.4]), t: [-3, 1, 2] },
  };
  const agents = ['anna', 'robot-2'];
  let utime = startUtime;
  for (let i = 0; i < photosEach; ++i) {
    for (const a of [0, 1]) {
      const f = i / Math.max(photosEach - 1, 1);
      // From both ends to the middle; the last ones overlap.
      const x = a === 0 ? -19 + 19 * f : 20 - 19 * f;
      const eye = [x, -6.5 + 1.1 * Math.sin(3 * f + a), 1.7 + (a === 1 ? 1.6 : 0)];
      const at = [x + (a === 0 ? 1 : -1) * (1.5 + 2 * Math.sin(7 * f)), 6, 2.4 + 1.4 * Math.sin(5 * f)];
      const id = photos.length + 1;
      utime += 550_000 + 400_000 * random();
      const photo = {
        id, agent: agents[a], name: `${a === 0 ? 'IMG' : 'frame'}_${String(i + 1).padStart(4, '0')}.jpg`,
        centre: eye, worldFromCam: lookAt(eye, at), submap: a + 1, received: utime,
      };
      if (id === 12) photo.name = '<img src=x onerror=alert(1)>.jpg';
      photos.push(photo);
    }
  }
  for (const photo of photos) {
    photo.seen = new Map();
    points.forEach((point, i) => {
      const at = projectTo(photo, point.xyz);
      if (at && at[2] < 22) photo.seen.set(i, at);
    });
  }
  const shared = (a, b) => {
    let n = 0;
    for (const i of a.seen.keys()) n += b.seen.has(i);
    return n;
  };
  const refusedIds = new Set([17, 30]);
  const failedId = 23;
  const firstOf = {};
  const mergeFrom = Math.floor(1.72 * photosEach);
  let merged = false;
  const similarity = sim.compose(frames[1], sim.invert(frames[2]));
  for (const photo of photos) {
    const { id } = photo;
    let t = photo.received;
    add(t + 40_000, 'photo', {
      image: id, agent: photo.agent, name: photo.name, camera: photo.submap, width: kWidth, height: kHeight, bytes: 1_400_000 + 9000 * id,
      focal: kFocal, captured: t - 3_000_000, received: t,
      ...(gps ? { gps: [52.5 + photo.centre[1] / 111132.95, 13.4 + photo.centre[0] / (111319.49 * Math.cos((52.5 * Math.PI) / 180)), 34 + photo.centre[2]] } : {}),
    });
    if (id === failedId) {
      add(t + 300_000, 'failure', { image: id, agent: photo.agent, name: photo.name, stage: 'features', cause: 'failed', reason: 'decodes to 0 x 0 pixels (features-1)', parked: true });
      continue;
    }
    t += 420_000 + 200_000 * random();
    add(t, 'described', { image: id, keypoints: 5200 + Math.floor(2500 * random()), s: 0.36 });
    add(t + 20_000, 'candidates', { image: id, count: Math.min(30, id - 1) });
    t += 350_000 + 300_000 * random();
    const pairs = [];
    for (const other of photos) {
      if (other.id >= id || other.id === failedId || id === 30 || other.id === 30) continue;
      const n = Math.floor(shared(photo, other) * (600 / (numPoints / 100 + 600)) * (0.4 + 0.3 * random()));
      if (n >= 60) pairs.push([other.id, Math.floor(n)]);
    }
    add(t, 'matched', { image: id, pairs: pairs.sort((a, b) => b[1] - a[1]).slice(0, 25), s: 0.31 });
    photo.pairs = pairs;
    t += 250_000 + 350_000 * random();
    const submap = merged ? 1 : photo.submap;
    firstOf[photo.submap] ??= [];
    firstOf[photo.submap].push(photo);
    const common = { image: id, submap, inliers: 480 + Math.floor(300 * random()), visible: 900, error_px: 0.52, s: 0.21 };
    if (refusedIds.has(id)) {
      if (id === 17) add(t, 'registration', { ...common, state: 'deferred', cause: 'weak overlap', reason: 'pose badly determined by its inliers', inliers: 41, visible: 120 });
      continue;
    }
    const waiting = firstOf[photo.submap];
    if (!merged && waiting.length < 2) continue;
    if (!merged && waiting.length === 2) add(t - 5000, 'submap', { submap, state: 'seeded', photos: 0, points: 0, reason: '', merged_into: 0, error_px: 0 });
    for (const p of !merged && waiting.length === 2 ? waiting : [photo]) {
      p.placedAt = t;
      p.placedIn = submap;
      add(t, 'registration', { ...common, image: p.id, state: 'registered', reason: '', pose: poseIn(frames[submap], p).map((v) => Number(v.toPrecision(7))) });
    }
    if (!merged && id >= mergeFrom) {
      const order = { merge: 900, source: 2, target: 1, similarity: [similarity.s, ...similarity.q, ...similarity.t], reason: '', s: 0 };
      add(t + 100_000, 'merge', { ...order, state: 'ordered' });
      add(t + 700_000, 'merge', { ...order, state: 'frozen', similarity: undefined });
      for (const p of photos) {
        if (p.placedIn !== 2) continue;
        add(t + 1_900_000, 'registration', { ...common, image: p.id, submap: 1, state: 'registered', reason: '', pose: poseIn(frames[1], p) });
        p.movedAt = t + 1_900_000;
      }
      add(t + 1_950_000, 'merge', { ...order, state: 'done', similarity: undefined, s: 1.85 });
      add(t + 1_951_000, 'submap', { submap: 2, state: 'ended', photos: 0, points: 0, reason: 'merged into map 1', merged_into: 1, error_px: 0 });
      merged = t + 1_950_000;
    }
  }
  add(photos[9].received + 10_000, 'failure', { image: 0, agent: 'anna', name: 'notes.txt', stage: 'ingest', cause: 'unreadable', reason: 'not a JPEG, PNG or TIFF', parked: true });
  add(photos[5].received, 'merge', { merge: 0, state: 'failed', source: 2, target: 1, reason: 'too few common photos', s: 0.02 });
  const last = Math.max(...events.map((e) => e.t));
  ['requested', 'drained', 'batch', 'settled'].forEach((state, i) => add(last + 1_100_000 * (i + 1), 'finish', {
    finish: 990, state, ...(state === 'requested' && { deadline: last + kFinishUs }),
  }));
  add(last + 5_600_000, 'submap', { submap: 1, state: 'final', photos: 45, points: 41000, reason: '', merged_into: 0, error_px: 0.49, expected_error_percent: 0.11 });
  add(last + 6_000_000, 'finish', { finish: 990, state: 'done' });
  events.sort((a, b) => a.t - b.t);
  // Some facts make no event.
  events.forEach((e, i) => {
    e.seq = 3 + i + Math.floor(i / 9);
  });
  const mergeEvents = events.filter((e) => e.kind === 'merge' && e.merge === 900);
  for (const e of mergeEvents) e.merge = mergeEvents[0].seq;
  return { points, photos, events, frames, mergedAt: merged || Infinity, width: kWidth, height: kHeight, focal: kFocal };
}

// The shape of a submap at a time, as the server tells it, with the points of each chunk; null if there is none.
export function shapeAt(session, submap, utime) {
  const joined = utime >= session.mergedAt;
  if (joined && submap === 2) return null;
  const of = session.photos.filter((p) => p.placedAt <= utime && (p.placedIn === submap || (joined && submap === 1)));
  if (of.length < 2) return null;
  const frame = session.frames[submap];
  const seen = new Map(); // point -> photos
  for (const photo of of) {
    for (const i of photo.seen.keys()) {
      if (!seen.has(i)) seen.set(i, []);
      seen.get(i).push(photo.id);
    }
  }
  const shown = [...seen].filter(([i, by]) => by.length >= 2 && (i * 2654435761) % 100 < 70);
  const kPart = 8192;
  const chunks = [];
  for (let at = 0; at < shown.length; at += kPart) {
    const part = shown.slice(at, at + kPart);
    chunks.push({ id: chunks.length + 1, version: of.length, points: part.length, part });
  }
  return {
    manifest: {
      submap, version: of.length + (joined ? 1000 : 0), utime_us: utime,
      photos: of.map((p) => ({ image: p.id, camera: 1, pose: poseIn(frame, p) })),
      cameras: { 1: { width: session.width, height: session.height, fx: session.focal, fy: session.focal, cx: session.width / 2, cy: session.height / 2 } },
      chunks: chunks.map(({ id, version, points }) => ({ id, version: version + (joined ? 1000 : 0), points })),
    },
    chunks,
    frame,
  };
}

// What the guide would say: of each agent's newest photo, half a metre to its right.
export function guidanceAt(session, utime) {
  const placed = session.photos.filter((p) => p.placedAt <= utime);
  const mapOf = (p) => (utime >= session.mergedAt ? 1 : p.placedIn);
  const newest = new Map(placed.map((p) => [p.agent, p]));
  const guidance = [...new Set(placed.map(mapOf))].map((submap) => ({
    submap, verdict: utime >= session.mergedAt ? 'nearly' : 'weak', good_share: 0.829, open: 12, photos: placed.length,
    sentence: '82 % of the surface is good, 12 open borders: keep going',
  }));
  const advice = [...newest.values()].map((p) => {
    const [qw, qx, qy, qz, x, y, z] = poseIn(session.frames[mapOf(p)], p);
    return {
      agent: p.agent, submap: mapOf(p), last_photo: p.id, working_distance: 6, metres_per_unit: 1,
      stations: [0.5, 1].map((right) => ({
        pose: [qw, qx, qy, qz, x - right, y, z], nearest: p.id, why: 'few_photos', offset: [3 * right, 0, right],
        sentence: `${right.toFixed(1)} m to the right from where ${p.agent}/${p.id}.jpg was taken: too few photos see this place`,
      })),
    };
  });
  return { guidance, advice };
}

export function chunkBytes(session, { frame }, { part, version }) {
  return encodeChunk(part.map(([i, by]) => ({ xyz: sim.apply(frame, session.points[i].xyz), colour: session.points[i].colour, quality: by.length })), version);
}

// points: [{xyz, colour, quality}]
function encodeChunk(points, version) {
  const xyz = points.map((p) => p.xyz);
  const low = [0, 1, 2].map((k) => Math.min(...xyz.map((p) => p[k])));
  const high = [0, 1, 2].map((k) => Math.max(...xyz.map((p) => p[k])));
  const step = Math.max(...high.map((v, k) => v - low[k]), 1e-9) / 65535;
  const bytes = new DataView(new ArrayBuffer(48 + 10 * points.length));
  bytes.setUint32(0, 0x534b4331, false);
  bytes.setUint32(4, points.length, true);
  low.forEach((v, k) => bytes.setFloat64(8 + 8 * k, v, true));
  bytes.setFloat64(32, step, true);
  bytes.setBigUint64(40, BigInt(version), true);
  points.forEach(({ colour, quality }, n) => {
    const at = 48 + 10 * n;
    xyz[n].forEach((v, k) => bytes.setUint16(at + 2 * k, Math.round((v - low[k]) / step), true));
    colour.forEach((v, k) => bytes.setUint8(at + 6 + k, v));
    bytes.setUint8(at + 9, Math.min(255, quality));
  });
  return Buffer.from(bytes.buffer);
}

const kSplat = 0.36; // metres: a point of the world covers as much of a depth map
const kDepthUs = 1_000_000; // from a photo's place to its depth map

// Points of a photo's depth map, `px` pixels on its longer side, in a random order: [{xyz: in the camera's frame, in a
// unit of the photo's own, colour, quality: the nearer the surer}], and the unit in metres.
export function depthPoints(session, photo, px) {
  const f = px / session.width;
  const [width, height] = [px, Math.round(session.height * f)];
  const focal = session.focal * f;
  const depth = new Float32Array(width * height).fill(Infinity);
  const nearest = new Int32Array(width * height); // the point, where there is a depth
  for (const [i, [x, y, z]] of photo.seen) {
    const half = Math.max(0.5, (0.5 * kSplat * focal) / z);
    for (let v = Math.max(0, Math.round(y * f - half)); v < Math.min(height, y * f + half); ++v) {
      for (let u = Math.max(0, Math.round(x * f - half)); u < Math.min(width, x * f + half); ++u) {
        if (z >= depth[v * width + u]) continue;
        depth[v * width + u] = z;
        nearest[v * width + u] = i;
      }
    }
  }
  const unit = 1 + 0.5 * (photo.id % 3);
  const farthest = depth.reduce((far, z) => (z < Infinity ? Math.max(far, z) : far), 0);
  const random = randomOf(photo.id);
  const points = [];
  depth.forEach((z, pixel) => {
    if (z === Infinity) return;
    const [u, v] = [pixel % width, Math.floor(pixel / width)];
    const ray = [(u + 0.5 - width / 2) / focal, (v + 0.5 - height / 2) / focal, 1];
    points.push({ xyz: sim.scaled(ray, z / unit), colour: session.points[nearest[pixel]].colour, quality: Math.round(255 * (1 - z / farthest)), order: random() });
  });
  return { points: points.sort((a, b) => a.order - b.order), unit, share: points.length / (width * height) };
}

// The dense surface of a submap at a time, as the server tells it; null if there is none. mapOf(photo): its depthPoints().
export function denseAt(session, submap, utime, mapOf) {
  const shape = shapeAt(session, submap, utime);
  const images = shape?.manifest.photos.map((p) => p.image).filter((image) => session.photos[image - 1].placedAt + kDepthUs <= utime) ?? [];
  if (images.length === 0) return null;
  const photos = images.map((image) => {
    const { points, unit, share } = mapOf(session.photos[image - 1]);
    const chunks = [];
    for (let at = 0; at < points.length; at += kMaxChunkPoints) {
      chunks.push({ id: 100 * image + chunks.length, version: 1, points: Math.min(kMaxChunkPoints, points.length - at) });
    }
    return { image, scale: shape.frame.s * unit, share, chunks };
  });
  return { submap, version: shape.manifest.version + images.length, photos };
}

// A chunk of denseAt() by its id.
export function denseChunkBytes({ points }, id) {
  const from = (id % 100) * kMaxChunkPoints;
  return encodeChunk(points.slice(from, from + kMaxChunkPoints), 1);
}

const [kMeshColumns, kMeshRows] = [32, 24]; // of squares

// The mesh of a submap at a time, as the server tells it; null if there is none. A chunk is a piece of a plane before a photo.
export function meshAt(session, submap, utime) {
  const shape = shapeAt(session, submap, utime);
  if (!shape) return null;
  const frame = shape.manifest.photos.map(({ image, pose }) => ({ image, pose }));
  const { version } = shape.manifest;
  const joined = version >= 1000 ? 2 : 1; // poses are others then
  return { submap, version, voxel: 0.05, frame, chunks: frame.map(({ image }) => ({ id: image, version: joined, triangles: 2 * kMeshColumns * kMeshRows })) };
}

// At the median depth of what the photo sees. scale: of the submap's frame.
export function meshChunkBytes(session, photo, pose, scale, version) {
  const { centre, worldFromCam } = sim.cameraPlace(pose);
  const depths = [...photo.seen.values()].map(([, , z]) => z).sort((a, b) => a - b);
  const depth = scale * depths[depths.length >> 1];
  const vertices = [];
  for (let v = 0; v <= kMeshRows; ++v) {
    for (let u = 0; u <= kMeshColumns; ++u) {
      const ray = [((u / kMeshColumns - 0.5) * session.width) / session.focal, ((v / kMeshRows - 0.5) * session.height) / session.focal, 1];
      vertices.push(sim.add(centre, sim.rotate(worldFromCam, sim.scaled(ray, depth))));
    }
  }
  const triangles = [];
  for (let v = 0; v < kMeshRows; ++v) {
    for (let u = 0; u < kMeshColumns; ++u) {
      const a = v * (kMeshColumns + 1) + u;
      const below = a + kMeshColumns + 1;
      triangles.push([a, below, below + 1], [a, below + 1, a + 1]);
    }
  }
  return encodeMesh(vertices, triangles, [90 + (photo.id * 37) % 150, 110, 200 - (photo.id * 53) % 150], version);
}

export function encodeMesh(vertices, triangles, colour, version) {
  const low = [0, 1, 2].map((k) => Math.min(...vertices.map((p) => p[k])));
  const high = [0, 1, 2].map((k) => Math.max(...vertices.map((p) => p[k])));
  const step = Math.max(...high.map((v, k) => v - low[k]), 1e-9) / 65535;
  const bytes = new DataView(new ArrayBuffer(52 + 9 * vertices.length + 6 * triangles.length));
  bytes.setUint32(0, 0x534b5431, false);
  bytes.setUint32(4, vertices.length, true);
  bytes.setUint32(8, triangles.length, true);
  low.forEach((v, k) => bytes.setFloat64(12 + 8 * k, v, true));
  bytes.setFloat64(36, step, true);
  bytes.setBigUint64(44, BigInt(version), true);
  vertices.forEach((p, n) => {
    p.forEach((v, k) => bytes.setUint16(52 + 9 * n + 2 * k, Math.round((v - low[k]) / step), true));
    colour.forEach((v, k) => bytes.setUint8(52 + 9 * n + 6 + k, v));
  });
  triangles.flat().forEach((v, n) => bytes.setUint16(52 + 9 * vertices.length + 2 * n, v, true));
  return Buffer.from(bytes.buffer);
}

const kDots = 1000; // of a drawing: a browser takes longer over ten times as many than over a photo

// The photo as a drawing: what its camera sees of the points, or of a sample of them with larger dots.
export function drawing(session, photo, width) {
  const f = width / session.width;
  const height = session.height * f;
  const share = Math.min(1, kDots / photo.seen.size);
  const sample = [...photo.seen].filter((_, n) => Math.floor(n * share) !== Math.floor((n - 1) * share));
  const dots = sample.sort((a, b) => b[1][2] - a[1][2]).map(([i, [x, y, z]]) => {
    const [r, g, b] = session.points[i].colour;
    const size = Math.max(1, (0.32 * session.focal * f) / (z * Math.sqrt(share)));
    return `<rect x="${(x * f).toFixed(1)}" y="${(y * f).toFixed(1)}" width="${size.toFixed(1)}" height="${size.toFixed(1)}" fill="rgb(${r},${g},${b})"/>`;
  });
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"><rect width="100%" height="100%" fill="#a8c8e0"/>${dots.join('')}</svg>`;
}
