// Frames on a plane: {origin, x, y, z}, three orthogonal unit vectors, z the normal of the plane of x and y. A point has
// the coordinates u along x, v along y and h along z. Points are flat arrays, three values a point. Pure functions.
import { cross, dot, scaled, subtract, unit } from './similarity.js';

// along: any direction that is not parallel to the unit vector z; x is its part on the plane.
export function frameOf(origin, z, along) {
  const x = unit(subtract(along, scaled(z, dot(along, z))));
  return { origin, x, y: cross(z, x), z };
}

// eachPoint(visit) calls visit(x, y, z) of each point. visit(u, v, h, x, y, z) here.
export function eachInFrame({ origin, x, y, z }, eachPoint, visit) {
  eachPoint((px, py, pz) => {
    const [dx, dy, dz] = [px - origin[0], py - origin[1], pz - origin[2]];
    visit(
      dx * x[0] + dy * x[1] + dz * x[2], dx * y[0] + dy * y[1] + dz * y[2], dx * z[0] + dy * z[1] + dz * z[2], px, py, pz);
  });
}

// u, v, h of points.
export function inFrame(frame, points) {
  const found = new Float64Array(points.length);
  let end = 0;
  eachInFrame(frame, (visit) => eachOf(points, visit), (u, v, h) => {
    found[end++] = u;
    found[end++] = v;
    found[end++] = h;
  });
  return found;
}

export function eachOf(points, visit) {
  for (let i = 0; i < points.length; i += 3) visit(points[i], points[i + 1], points[i + 2]);
}
