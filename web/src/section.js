// The section: a box of the display's frame, with points inside of it shown and all others hidden. Its axes are east, north
// and up, or the map's own where nothing tells north: +x, -z and +y of the display. Bounds are in the display's unit.
// Pure functions.
import { quantile } from './frames.js';
import * as sim from './similarity.js';

export const kAxes = [{ k: 0, sign: 1 }, { k: 2, sign: -1 }, { k: 1, sign: 1 }]; // east, north, up in the display
const kOutliers = 0.005; // share of the points at either side that no slider reaches
const kMargin = 0.02; // of a range, beyond the points that sliders reach

// [[low, high], ...] along the axes that nothing is hidden by.
export const unbounded = () => kAxes.map(() => [-Infinity, Infinity]);
export const isUnbounded = (bounds) => bounds.flat().every((v) => !Number.isFinite(v));

// Along each axis, of points of the display's frame; null for none. A point outside of a range is hidden by no bound at its end.
export function rangesOf(points) {
  if (points.length === 0) return null;
  return kAxes.map(({ k, sign }) => {
    const along = points.map((p) => sign * p[k]);
    const [low, high] = [quantile(along, kOutliers), quantile(along, 1 - kOutliers)];
    const margin = kMargin * (high - low) || 1;
    return [low - margin, high + margin];
  });
}

// {low, high}: corners of the box in the display's frame.
export function displayBox(bounds) {
  const box = { low: [0, 0, 0], high: [0, 0, 0] };
  kAxes.forEach(({ k, sign }, i) => {
    const [low, high] = bounds[i];
    [box.low[k], box.high[k]] = sign > 0 ? [low, high] : [-high, -low];
  });
  return box;
}

// A bound that a slider of `steps` steps at `at` stands for: none where it is at its own end of the range.
export function boundAt([low, high], side, at, steps) {
  if (at === (side === 0 ? 0 : steps)) return side === 0 ? -Infinity : Infinity;
  return low + ((high - low) * at) / steps;
}

// The slider's step that is nearest to a bound.
export function stepOf([low, high], bound, steps) {
  return Math.round(steps * Math.max(0, Math.min(1, (bound - low) / (high - low))));
}

// Where a bound is drawn and told: its range's end where it has none.
export const within = (bounds, ranges) => bounds.map(([low, high], i) => [Math.max(low, ranges[i][0]), Math.min(high, ranges[i][1])]);

// visit(x, y, z) of a submap's frame, called for points inside the box alone. place: display_from_submap
export function visitInside({ low, high }, { s, q, t }, visit) {
  const [a, b, c] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => sim.scaled(sim.rotate(q, axis), s));
  return (x, y, z) => {
    for (let k = 0; k < 3; ++k) {
      const v = a[k] * x + b[k] * y + c[k] * z + t[k];
      if (v < low[k] || v > high[k]) return;
    }
    visit(x, y, z);
  };
}

// [[from, to], ...] in the display's frame.
export function boxEdges({ low, high }) {
  const corner = (i) => [0, 1, 2].map((k) => (i & (1 << k) ? high[k] : low[k]));
  const edges = [];
  for (let i = 0; i < 8; ++i) for (let k = 0; k < 3; ++k) if (!(i & (1 << k))) edges.push([corner(i), corner(i | (1 << k))]);
  return edges;
}
