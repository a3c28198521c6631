// Where to look from, so that all that matters is seen.
import { quantile } from '../frames.js';
import * as sim from '../similarity.js';

const kNearest = 2;
const kFarthest = 4000;

// From as near as possible so that nearly all of it is seen. points, cameras: places; axes: {right, up, forward} of the
// view; tanX, tanY: of half its angles; cameraDepth: of a camera as it is drawn. The target's distance, and `reach`: how
// far things are from the target.
export function framing({ points, cameras }, { right, up, forward }, { tanX, tanY, cameraDepth }) {
  const target = [0, 1, 2].map((k) => {
    const [of, along] = [cameras.map((p) => p[k]), points.map((p) => p[k])];
    const low = Math.min(...(along.length ? [quantile(along, 0.04)] : []), ...(of.length ? [quantile(of, 0.02)] : []));
    const high = Math.max(...(along.length ? [quantile(along, 0.96)] : []), ...(of.length ? [quantile(of, 0.98)] : []));
    return (low + high) / 2;
  });
  const needed = (p) => {
    const v = sim.subtract(p, target);
    return Math.max(Math.abs(sim.dot(v, right)) / tanX, Math.abs(sim.dot(v, up)) / tanY) - sim.dot(v, forward);
  };
  const distance = Math.max(quantile(points.map(needed), 0.95), quantile(cameras.map(needed), 0.99) + cameraDepth, kNearest);
  const reach = quantile(points.concat(cameras).map((p) => sim.distance(p, target)), 0.97);
  return { target, distance: Math.min(distance, kFarthest), reach };
}

// As the cameras look, a little from the side and from above; photos of an object all around have no such direction.
// views: [{submap, forward}], one a camera
export function bestDirection(views) {
  const mean = views.reduce((sum, { forward }) => sim.add(sum, sim.scaled(forward, 1 / views.length)), [0, 0, 0]);
  const level = Math.hypot(mean[0], mean[2]);
  const pitch = mean[1] < -0.6 ? 0.95 : 0.45;
  // Maps stand side by side along x.
  if (new Set(views.map((v) => v.submap)).size > 1) return { yaw: 0.15, pitch };
  return { yaw: level > 0.25 ? Math.atan2(-mean[0], -mean[2]) + 0.4 : 0.6, pitch };
}
