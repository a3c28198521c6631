// Similarities x -> s R(q) x + t, quaternions as [w, x, y, z], vectors as [x, y, z]. `a_from_b` maps b's frame to a's.

export const identity = () => ({ s: 1, q: [1, 0, 0, 0], t: [0, 0, 0] });

export function multiply([aw, ax, ay, az], [bw, bx, by, bz]) {
  return [
    aw * bw - ax * bx - ay * by - az * bz,
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
  ];
}

export const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];

export function normalized(q) {
  const n = Math.hypot(...q);
  return n > 0 ? q.map((v) => v / n) : [1, 0, 0, 0];
}

export function rotate([w, x, y, z], [vx, vy, vz]) {
  const tx = 2 * (y * vz - z * vy);
  const ty = 2 * (z * vx - x * vz);
  const tz = 2 * (x * vy - y * vx);
  return [vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx];
}

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a, f) => [a[0] * f, a[1] * f, a[2] * f];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
export const unit = (a) => {
  const n = Math.hypot(...a);
  return n > 0 ? scaled(a, 1 / n) : [0, 0, 0];
};

export function apply(m, x) {
  return add(scaled(rotate(m.q, x), m.s), m.t);
}

// a_from_c of a_from_b and b_from_c.
export function compose(a, b) {
  return { s: a.s * b.s, q: normalized(multiply(a.q, b.q)), t: apply(a, b.t) };
}

export function invert(m) {
  const q = conjugate(m.q);
  return { s: 1 / m.s, q, t: scaled(rotate(q, m.t), -1 / m.s) };
}

// As in merge events: [scale, qw, qx, qy, qz, tx, ty, tz].
export function fromArray(a) {
  if (!Array.isArray(a) || a.length !== 8 || !a.every(Number.isFinite) || !(a[0] > 0)) return null;
  return { s: a[0], q: normalized(a.slice(1, 5)), t: a.slice(5, 8) };
}

export function slerp(a, b, f) {
  let cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const to = cosine < 0 ? b.map((v) => -v) : b;
  cosine = Math.abs(cosine);
  if (cosine > 0.9995) return normalized(a.map((v, i) => v + f * (to[i] - v)));
  const angle = Math.acos(cosine);
  const u = Math.sin((1 - f) * angle) / Math.sin(angle);
  const v = Math.sin(f * angle) / Math.sin(angle);
  return normalized(a.map((x, i) => u * x + v * to[i]));
}

// From a (f = 0) to b (f = 1); the scale goes by its logarithm. `pivot`, in the frame that is moved, goes straight.
export function interpolate(a, b, f, pivot = [0, 0, 0]) {
  const s = Math.exp(Math.log(a.s) + f * (Math.log(b.s) - Math.log(a.s)));
  const q = slerp(a.q, b.q, f);
  const from = apply(a, pivot);
  const to = apply(b, pivot);
  const at = from.map((v, i) => v + f * (to[i] - v));
  return { s, q, t: subtract(at, scaled(rotate(q, pivot), s)) };
}

// The shortest rotation that takes unit vector a to unit vector b.
export function rotationBetween(a, b) {
  const c = dot(a, b);
  if (c < -0.999999) {
    const axis = unit(Math.abs(a[0]) < 0.9 ? cross(a, [1, 0, 0]) : cross(a, [0, 1, 0]));
    return [0, ...axis];
  }
  return normalized([1 + c, ...cross(a, b)]);
}

// Of cam_from_world [qw, qx, qy, qz, tx, ty, tz]: where the camera is, and world_from_cam's rotation.
export function cameraPlace(pose) {
  const q = normalized(pose.slice(0, 4));
  const worldFromCam = conjugate(q);
  return { centre: scaled(rotate(worldFromCam, pose.slice(4, 7)), -1), worldFromCam };
}

// Eigenvalues, ascending, and unit eigenvectors of a symmetric matrix (rows), by Jacobi's method.
export function eigenSymmetric(rows) {
  const n = rows.length;
  const a = rows.map((r) => [...r]);
  const v = rows.map((_, i) => rows.map((__, j) => (i === j ? 1 : 0)));
  for (let sweep = 0; sweep < 50; ++sweep) {
    let off = 0;
    for (let i = 0; i < n; ++i) for (let j = i + 1; j < n; ++j) off += a[i][j] ** 2;
    if (off < 1e-30) break;
    for (let p = 0; p < n; ++p) {
      for (let q = p + 1; q < n; ++q) {
        if (Math.abs(a[p][q]) < 1e-300) continue;
        const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const t = (theta >= 0 ? 1 : -1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
        const c = 1 / Math.sqrt(t * t + 1);
        const s = t * c;
        for (let k = 0; k < n; ++k) [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
        for (let k = 0; k < n; ++k) [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
        for (let k = 0; k < n; ++k) [v[k][p], v[k][q]] = [c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]];
      }
    }
  }
  return rows
    .map((_, i) => ({ value: a[i][i], vector: v.map((row) => row[i]) }))
    .sort((x, y) => x.value - y.value);
}

// The similarity with the smallest sum of squares that takes points b to a (Horn 1987, by quaternions). Null where
// the points do not determine it.
export function fitSimilarity(a, b) {
  const n = a.length;
  if (n < 3) return null;
  const mean = (points) => scaled(points.reduce(add, [0, 0, 0]), 1 / n);
  const ma = mean(a);
  const mb = mean(b);
  const S = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]; // sum of b a^T
  let va = 0;
  let vb = 0;
  const spread = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  for (let i = 0; i < n; ++i) {
    const x = subtract(b[i], mb);
    const y = subtract(a[i], ma);
    va += dot(y, y);
    vb += dot(x, x);
    for (let r = 0; r < 3; ++r) {
      for (let c = 0; c < 3; ++c) {
        S[r][c] += x[r] * y[c];
        spread[r][c] += x[r] * x[c];
      }
    }
  }
  const eigen = eigenSymmetric(spread);
  if (!(vb > 0) || !(va > 0) || eigen[1].value < 1e-4 * eigen[2].value) return null; // on a line
  const [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = S;
  const N = [
    [xx + yy + zz, yz - zy, zx - xz, xy - yx],
    [yz - zy, xx - yy - zz, xy + yx, zx + xz],
    [zx - xz, xy + yx, -xx + yy - zz, yz + zy],
    [xy - yx, zx + xz, yz + zy, -xx - yy + zz],
  ];
  const q = normalized(eigenSymmetric(N)[3].vector);
  const s = Math.sqrt(va / vb);
  return { s, q, t: subtract(ma, scaled(rotate(q, mb), s)) };
}
