// When a point came, for the replay. A chunk does not tell; so a point counts as there once two placed cameras have it in
// view, not farther than what they mostly see. Nothing tells of walls in between: it is an estimate. Pure functions.
import { median } from './median.js';
import { conjugate, rotate } from './similarity.js';

const kFarther = 2.5; // times the median depth of what a camera sees
const kSampled = 400;

// What is needed of cameras {centre, worldFromCam, aspect}, in the order in which they were placed. `points`: a sample
// of the submap's points.
export function prepareCameras(cameras, points) {
  const every = Math.max(1, Math.floor(points.length / kSampled));
  const sample = points.filter((_, i) => i % every === 0);
  return cameras.map(({ centre, worldFromCam, aspect }) => {
    const q = conjugate(worldFromCam);
    const columns = [rotate(q, [1, 0, 0]), rotate(q, [0, 1, 0]), rotate(q, [0, 0, 1])];
    const camera = { centre, rows: [0, 1, 2].map((k) => columns.map((c) => c[k])), tanX: aspect[0], tanY: aspect[1], far: Infinity };
    const depths = sample.map((p) => depthIn(camera, p[0], p[1], p[2])).filter((d) => d > 0);
    if (depths.length > 0) camera.far = kFarther * median(depths);
    return camera;
  });
}

// The point's depth if it is in view, else 0.
function depthIn({ centre, rows: [rx, ry, rz], tanX, tanY, far }, px, py, pz) {
  const x = px - centre[0];
  const y = py - centre[1];
  const z = pz - centre[2];
  const depth = rz[0] * x + rz[1] * y + rz[2] * z;
  if (depth <= 0 || depth > far) return 0;
  if (Math.abs(rx[0] * x + rx[1] * y + rx[2] * z) > tanX * depth) return 0;
  return Math.abs(ry[0] * x + ry[1] * y + ry[2] * z) > tanY * depth ? 0 : depth;
}

// For each point of a chunk: how many cameras are placed when the second one sees it. Where none does: all.
export function ranksOf(chunk, cameras, count = chunk.points) {
  const ranks = new Uint16Array(chunk.points).fill(Math.min(cameras.length, 65535));
  const { origin, step, position } = chunk;
  for (let i = 0; i < count; ++i) {
    const x = origin[0] + step * position[4 * i];
    const y = origin[1] + step * position[4 * i + 1];
    const z = origin[2] + step * position[4 * i + 2];
    let seen = 0;
    for (let c = 0; c < cameras.length; ++c) {
      if (depthIn(cameras[c], x, y, z) === 0) continue;
      if (++seen === 2) {
        ranks[i] = Math.min(c + 1, 65535);
        break;
      }
    }
  }
  return ranks;
}
