// Area of a polygon on the points of a map, and volume between its points and a base plane: heaps of gravel, earth or wood.
// Lengths are in the unit of the points' frame. Points are flat arrays, three values a point. Pure functions.
import { medianOfSorted } from './median.js';
import { eachInFrame, eachOf, frameOf, inFrame } from './plane_frame.js';
import { add, cross, distance, dot, scaled, subtract, unit } from './similarity.js';

export const kCellPoints = 8; // in the median of the cells that hold any; fewer points in all give no volume
const kRounds = 6; // of the search for the side of such cells
const kMaxCells = 4e6; // of the outline's bounding box: 80 MB
const kMargin = 0.1; // of the longer side of the outline's bounding box: so far around it points are looked at
const kSplit = 4; // samples along a cell's side, which tell the cell's share inside
const kSteepest = Math.SQRT1_2; // cosine of 45 degrees: steeper than loose material lies
const kThinnest = 1e-9; // area over squared perimeter of corners that lie on a line, but for rounding

// corners: [[x, y, z], ...] of a closed polygon. up: a unit vector. eachPoint(visit) calls visit(x, y, z) of each point.
// Returns {area, numPoints: inside, why: null, cell: a side, above, below: volumes, empty: share of the area without points}.
// Without a volume: {area, numPoints, why}, `why` being 'points' (too few inside) or 'steep' (the base plane).
// Returns null for corners that make no polygon: fewer than 3, sides that cross, corners on a line.
//
// Base plane: least squares through the points within one cell of an edge, and the corners. A cell's height is the median
// of its points'; an empty cell takes the mean of its neighbours.
export function measureHeap(corners, up, eachPoint) {
  const rough = frameOfCorners(corners, up);
  const outline = rough && outlineIn(rough, corners);
  if (!outline || crossesItself(outline)) return null;
  const { points, seen } = pointsOver(rough, boxOf(outline), eachPoint);
  const inside = chosen(seen, (u, v) => isInside(outline, u, v));
  const numPoints = inside.length / 3;
  const tooFew = { area: areaOf(outline), numPoints, why: 'points' };
  if (numPoints < kCellPoints) return tooFew;
  const cell = cellSide(outline, inside);
  if (chosen(inside, (u, v) => !isNear(outline, u, v, cell)).length === 0) return tooFew; // no heap beside its border
  const border = chosen(seen, (u, v) => isNear(outline, u, v, cell));
  const base = baseFrame(rough, [...inFrame(rough, corners.flat())], border);
  const foot = outlineIn(base, corners);
  const result = { area: areaOf(foot), numPoints };
  if (dot(base.z, up) < kSteepest) return { ...result, why: 'steep' };
  return { ...result, why: null, cell, ...volumes(foot, cell, inFrame(base, points)) };
}

// ---- frames of plane_frame.js

// Normal by Newell's sum. Null where the corners make no area.
function frameOfCorners(corners, up) {
  if (corners.length < 3) return null;
  const edges = edgesOf(corners);
  const twice = edges.reduce((sum, [a, b]) => add(sum, cross(subtract(a, corners[0]), subtract(b, corners[0]))), [0, 0, 0]);
  const perimeter = edges.reduce((sum, [a, b]) => sum + distance(a, b), 0);
  if (!(Math.hypot(...twice) / 2 > kThinnest * perimeter ** 2)) return null;
  const [from, to] = edges.reduce((best, edge) => (distance(...edge) > distance(...best) ? edge : best));
  const mean = scaled(corners.reduce(add), 1 / corners.length);
  return frameOf(mean, scaled(unit(twice), dot(twice, up) < 0 ? -1 : 1), subtract(to, from));
}

// h = c + a u + b v with the smallest sum of squares, as a frame.
function baseFrame({ origin, x, y, z }, corners, border) {
  const sums = { n: 0, u: 0, v: 0, h: 0, uu: 0, uv: 0, vv: 0, uh: 0, vh: 0 };
  for (const points of [corners, border]) eachOf(points, (u, v, h) => addTo(sums, u, v, h));
  const [u, v, h] = [sums.u / sums.n, sums.v / sums.n, sums.h / sums.n];
  const [uu, uv, vv] = [sums.uu - sums.n * u * u, sums.uv - sums.n * u * v, sums.vv - sums.n * v * v];
  const [uh, vh] = [sums.uh - sums.n * u * h, sums.vh - sums.n * v * h];
  const det = uu * vv - uv * uv;
  const [a, b] = [(uh * vv - vh * uv) / det, (vh * uu - uh * uv) / det];
  const middle = [origin, scaled(x, u), scaled(y, v), scaled(z, h)].reduce(add);
  return frameOf(middle, unit(subtract(z, add(scaled(x, a), scaled(y, b)))), x);
}

function addTo(sums, u, v, h) {
  const terms = { n: 1, u, v, h, uu: u * u, uv: u * v, vv: v * v, uh: u * h, vh: v * h };
  for (const name in terms) sums[name] += terms[name];
}

// Points over or under a box of the frame's plane, with a margin: as they are, and seen in the frame.
function pointsOver(frame, { low, high }, eachPoint) {
  const margin = kMargin * Math.max(high[0] - low[0], high[1] - low[1]);
  const [points, seen] = [[], []];
  eachInFrame(frame, eachPoint, (u, v, h, x, y, z) => {
    if (u < low[0] - margin || u > high[0] + margin || v < low[1] - margin || v > high[1] + margin) return;
    points.push(x, y, z);
    seen.push(u, v, h);
  });
  return { points, seen };
}

function chosen(points, isWanted) {
  const found = [];
  eachOf(points, (u, v, h) => {
    if (isWanted(u, v)) found.push(u, v, h);
  });
  return found;
}

// ---- outlines: [[u, v], ...]

const outlineIn = (frame, corners) => corners.map((corner) => [...inFrame(frame, corner).subarray(0, 2)]);
const edgesOf = (corners) => corners.map((a, i) => [a, corners[(i + 1) % corners.length]]);
const areaOf = (outline) => Math.abs(edgesOf(outline).reduce((sum, [a, b]) => sum + a[0] * b[1] - a[1] * b[0], 0)) / 2;

function boxOf(outline) {
  const along = (k) => outline.map((corner) => corner[k]);
  return { low: [Math.min(...along(0)), Math.min(...along(1))], high: [Math.max(...along(0)), Math.max(...along(1))] };
}

function crossesItself(outline) {
  const edges = edgesOf(outline);
  return edges.some((edge, i) => edges.some((other, j) => j > i && doCross(edge, other)));
}

function doCross([a, b], [c, d]) {
  const side = (p, q, r) => Math.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]));
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

// By the parity of the edges that a ray along u crosses.
function isInside(outline, u, v) {
  let inside = false;
  for (let i = 0, j = outline.length - 1; i < outline.length; j = i++) {
    const [[au, av], [bu, bv]] = [outline[i], outline[j]];
    if (av > v !== bv > v && u < au + ((v - av) * (bu - au)) / (bv - av)) inside = !inside;
  }
  return inside;
}

// Whether an edge is less than `reach` away.
function isNear(outline, u, v, reach) {
  for (let i = 0, j = outline.length - 1; i < outline.length; j = i++) {
    const [[au, av], [bu, bv]] = [outline[i], outline[j]];
    const [eu, ev] = [bu - au, bv - av];
    const along = ((u - au) * eu + (v - av) * ev) / (eu * eu + ev * ev || 1);
    const f = Math.max(0, Math.min(1, along));
    if ((u - au - f * eu) ** 2 + (v - av - f * ev) ** 2 < reach * reach) return true;
  }
  return false;
}

// ---- cells

// Side of the cells that hold kCellPoints points in the median of those that hold any. Holds at least one in the mean.
function cellSide(outline, inside) {
  const box = boxOf(outline);
  const area = areaOf(outline);
  const n = inside.length / 3;
  const least = Math.sqrt(Math.max(area / n, ((box.high[0] - box.low[0]) * (box.high[1] - box.low[1])) / kMaxCells));
  let side = Math.max(least, Math.sqrt((kCellPoints * area) / n));
  for (let round = 0; round < kRounds; ++round) {
    const held = medianOfSorted(countsIn(gridOver(box, side), inside).filter((count) => count > 0).sort());
    if (Math.abs(held - kCellPoints) <= 1) break;
    side = Math.max(least, side * Math.sqrt(kCellPoints / held));
  }
  return side;
}

const gridOver = ({ low, high }, cell) => ({
  low, cell, columns: Math.max(1, Math.ceil((high[0] - low[0]) / cell)), rows: Math.max(1, Math.ceil((high[1] - low[1]) / cell)),
});

// visit(cell, index of the point's first value) of the points over the grid.
function eachCell({ low, cell, columns, rows }, points, visit) {
  for (let i = 0; i < points.length; i += 3) {
    const column = Math.floor((points[i] - low[0]) / cell);
    const row = Math.floor((points[i + 1] - low[1]) / cell);
    if (column >= 0 && column < columns && row >= 0 && row < rows) visit(row * columns + column, i);
  }
}

function countsIn(grid, points) {
  const counts = new Uint32Array(grid.columns * grid.rows);
  eachCell(grid, points, (cell) => counts[cell]++);
  return counts;
}

// Of each cell the median height of its points; NaN where it has none.
function medianHeights(grid, points) {
  const counts = countsIn(grid, points);
  const ends = new Uint32Array(counts.length);
  let end = 0;
  counts.forEach((count, cell) => (ends[cell] = end += count));
  const next = ends.map((e, cell) => e - counts[cell]);
  const heights = new Float64Array(end); // cell by cell
  eachCell(grid, points, (cell, i) => (heights[next[cell]++] = points[i + 2]));
  return Float64Array.from(counts, (count, cell) => medianOfSorted(heights.subarray(ends[cell] - count, ends[cell]).sort()));
}

// Of each cell the share that lies inside.
function sharesInside({ low, cell, columns, rows }, outline) {
  return Float64Array.from({ length: columns * rows }, (_, at) => {
    const u = low[0] + ((at % columns) + 0.5) * cell;
    const v = low[1] + (Math.floor(at / columns) + 0.5) * cell;
    if (!isNear(outline, u, v, cell)) return isInside(outline, u, v) ? 1 : 0;
    return shareInside(outline, u, v, cell);
  });
}

function shareInside(outline, u, v, cell) {
  const off = (k) => ((k + 0.5) / kSplit - 0.5) * cell;
  let inside = 0;
  for (let i = 0; i < kSplit; ++i) for (let j = 0; j < kSplit; ++j) inside += isInside(outline, u + off(i), v + off(j));
  return inside / kSplit ** 2;
}

// From the border of a hole inwards, so that its cells go on as their surroundings.
function fill(grid, heights, empty) {
  for (let left = empty, before = Infinity; left.length > 0 && left.length < before;) {
    before = left.length;
    const means = left.map((cell) => meanAround(grid, heights, cell));
    left.forEach((cell, k) => (heights[cell] = means[k]));
    left = left.filter((cell) => Number.isNaN(heights[cell]));
  }
}

// Of the cells around one that have a height; NaN where none has.
function meanAround({ columns, rows }, heights, cell) {
  const [column, row] = [cell % columns, Math.floor(cell / columns)];
  let sum = 0;
  let n = 0;
  for (let r = Math.max(0, row - 1); r <= Math.min(rows - 1, row + 1); ++r) {
    for (let c = Math.max(0, column - 1); c <= Math.min(columns - 1, column + 1); ++c) {
      const height = heights[r * columns + c];
      if (Number.isNaN(height)) continue;
      sum += height;
      n++;
    }
  }
  return sum / n;
}

function volumes(outline, cell, points) {
  const grid = gridOver(boxOf(outline), cell);
  const heights = medianHeights(grid, points);
  const shares = sharesInside(grid, outline);
  const empty = [];
  shares.forEach((share, at) => share > 0 && Number.isNaN(heights[at]) && empty.push(at));
  const sum = (term) => shares.reduce((total, share, at) => total + (share > 0 ? share * term(at) : 0), 0);
  const share = empty.reduce((total, at) => total + shares[at], 0) / sum(() => 1);
  fill(grid, heights, empty);
  const above = cell ** 2 * sum((at) => Math.max(heights[at], 0) || 0);
  const below = cell ** 2 * sum((at) => Math.max(-heights[at], 0) || 0);
  return { above, below, empty: share };
}
