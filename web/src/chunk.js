// A chunk of a submap's points, as skein-web sends it (its README has the layout). Little endian.
const kHeaderBytes = 48;
const kPointBytes = 10;
export const kMaxChunkPoints = 16384;

// Throws on bytes that are no chunk. A prefix of a chunk is a chunk with fewer points: `points` are those that are
// there, `total` those that the whole chunk has.
export function decodeChunk(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < kHeaderBytes || view.getUint32(0, false) !== 0x534b4331) {
    throw new Error('not a chunk of points');
  }
  const total = view.getUint32(4, true);
  if (total > kMaxChunkPoints) throw new Error(`a chunk claims ${total} points`);
  const points = Math.min(total, Math.floor((buffer.byteLength - kHeaderBytes) / kPointBytes));
  const origin = [8, 16, 24].map((at) => view.getFloat64(at, true));
  const step = view.getFloat64(32, true);
  if (!origin.every(Number.isFinite) || !(step > 0) || !Number.isFinite(step)) {
    throw new Error('a chunk without a frame');
  }
  const version = Number(view.getBigUint64(40, true));
  // Four values each: GPUs want vertices of a multiple of four bytes.
  const position = new Uint16Array(4 * points);
  const colour = new Uint8Array(4 * points); // r, g, b, quality
  const bytes = new Uint8Array(buffer);
  let lowest = [65535, 65535, 65535];
  let highest = [0, 0, 0];
  for (let i = 0, at = kHeaderBytes; i < points; ++i, at += kPointBytes) {
    for (let k = 0; k < 3; ++k) {
      const value = bytes[at + 2 * k] | (bytes[at + 2 * k + 1] << 8);
      position[4 * i + k] = value;
      if (value < lowest[k]) lowest[k] = value;
      if (value > highest[k]) highest[k] = value;
    }
    for (let k = 0; k < 4; ++k) colour[4 * i + k] = bytes[at + 6 + k];
  }
  if (points === 0) [lowest, highest] = [[0, 0, 0], [0, 0, 0]];
  return { points, total, origin, step, version, position, colour, lowest, highest };
}

// Of a point, or a mesh's vertex, in the frame of the chunk.
export function pointOf(chunk, index) {
  return [0, 1, 2].map((k) => chunk.origin[k] + chunk.step * chunk.position[4 * index + k]);
}

// A chunk with the first `points` of its points.
export function prefixOf({ total, origin, step, version, position, colour, lowest, highest }, points) {
  return { points, total, origin, step, version, position: position.slice(0, 4 * points), colour: colour.slice(0, 4 * points), lowest, highest };
}

// The share of `total` points that a budget of points allows.
export const shareWithin = (budget, total) => (total > budget ? budget / total : 1);

// The bytes of a chunk's first `points` points.
export const prefixBytes = (points) => kHeaderBytes + kPointBytes * points;
