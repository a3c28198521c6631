// A profile: heights of a map's points along a straight line seen from above, within a strip. Lengths are in the unit of the
// points' frame. Pure functions.
import { medianOfSorted } from './median.js';
import { eachInFrame, frameOf } from './plane_frame.js';
import { dot, scaled, subtract } from './similarity.js';

export const kCells = 100; // along the line
const kStripCells = 2; // width of the strip
const kSteepest = 0.05; // horizontal part of the line over its length: steeper ones have no profile

// a, b: ends of the line, [x, y, z]. up: a unit vector. eachPoint(visit) calls visit(x, y, z) of each point.
// Returns {length, width, numPoints, from, to, cells}: `length` horizontal, `width` of the strip whose middle is the line,
// heights of a and b, and kCells cells from a to b. A cell is {distance: of its middle from a, points, height: the median of
// its points, lowest, highest}; the last three are null where it has none. Heights are over a.
// Returns null for a line that is steeper than kSteepest allows.
export function profileAlong(a, b, up, eachPoint) {
  const line = subtract(b, a);
  const rise = dot(line, up);
  const length = Math.hypot(...subtract(line, scaled(up, rise)));
  if (!(length > kSteepest * Math.hypot(...line))) return null;
  const cell = length / kCells;
  const width = kStripCells * cell;
  const heights = Array.from({ length: kCells }, () => []);
  let numPoints = 0;
  eachInFrame(frameOf(a, up, line), eachPoint, (u, v, h) => {
    if (u < 0 || u > length || Math.abs(v) > width / 2) return;
    heights[Math.min(kCells - 1, Math.floor(u / cell))].push(h);
    numPoints++;
  });
  return { length, width, numPoints, from: 0, to: rise, cells: heights.map((list, i) => cellOf((i + 0.5) * cell, list)) };
}

function cellOf(distance, heights) {
  const sorted = Float64Array.from(heights).sort();
  const has = sorted.length > 0;
  return {
    distance, points: sorted.length, height: has ? medianOfSorted(sorted) : null,
    lowest: has ? sorted[0] : null, highest: has ? sorted.at(-1) : null,
  };
}

// The same in another unit.
export function scaledProfile({ length, width, numPoints, from, to, cells }, factor) {
  const by = (v) => (v === null ? null : factor * v);
  return {
    length: by(length), width: by(width), numPoints, from: by(from), to: by(to),
    cells: cells.map(({ distance, points, height, lowest, highest }) => ({
      distance: by(distance), points, height: by(height), lowest: by(lowest), highest: by(highest),
    })),
  };
}

// [lowest, highest] of all that is drawn of a profile.
export function heightRange({ from, to, cells }) {
  const filled = cells.filter((cell) => cell.points > 0);
  return [
    filled.reduce((low, cell) => Math.min(low, cell.lowest), Math.min(from, to)),
    filled.reduce((high, cell) => Math.max(high, cell.highest), Math.max(from, to)),
  ];
}

// Stretches of neighbouring cells that have points: a line has a gap where there are none.
export function stretches(cells) {
  const found = [];
  cells.forEach((cell, i) => {
    if (cell.points === 0) return;
    if (i > 0 && cells[i - 1].points > 0) found.at(-1).push(cell);
    else found.push([cell]);
  });
  return found;
}

// Round values within [low, high], at most `most` of them: multiples of 1, 2 or 5 times a power of ten.
export function ticks(low, high, most) {
  if (!(high > low)) return [low];
  const least = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map((f) => f * power).find((v) => v > least * (1 - 1e-9));
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) found.push(Number((i * step).toPrecision(12)));
  return found.slice(0, most + 1);
}

// A line a cell, in the unit that is named in the first line. Cells without points have no heights.
export function profileCsv({ cells }, unit) {
  const told = (v) => (v === null ? '' : Number(v.toPrecision(7)).toString());
  const lines = cells.map((c) => [told(c.distance), told(c.height), told(c.lowest), told(c.highest), c.points].join(','));
  return `${[`distance_${unit},height_${unit},lowest_${unit},highest_${unit},points`, ...lines].join('\r\n')}\r\n`;
}
