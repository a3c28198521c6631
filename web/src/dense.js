// The dense surface of a submap: points of its photos' depth maps, in chunks. Each chunk belongs to one photo and lies in
// that photo's camera frame, so that an adjustment of the map moves matrices and loads nothing. Pure functions.
import { kMaxChunkPoints } from './chunk.js';
import * as sim from './similarity.js';

const kDiscs = Math.SQRT2; // diameter over spacing: discs as large cover a square grid

// The form of Shapes. A chunk's entry has the image that it belongs to.
export const kDense = {
  manifestPath: (submap) => `/api/submaps/${submap}/dense`,
  chunkPath: (submap, chunk) => `/api/submaps/${submap}/dense/${chunk}`,
  checked: checkedDense,
  dropsAbsent: true,
};

// {submap, version, photos: Map(image -> {scale, share, points}), chunks: [{id, version, points, image}]}. Leaves
// out photos without a scale, second entries of a photo or a chunk, and chunks with more points than a chunk has.
export function checkedDense({ submap, version, photos: list }) {
  if (!Array.isArray(list)) throw new Error('not a dense surface of a submap');
  const photos = new Map();
  const chunks = new Map();
  for (const photo of list) {
    if (!Number.isInteger(photo?.image) || !(photo.scale > 0) || !Number.isFinite(photo.scale) || photos.has(photo.image)) continue;
    const own = (Array.isArray(photo.chunks) ? photo.chunks : []).filter((c) => isChunk(c) && !chunks.has(c.id));
    for (const { id, version: of, points } of own) chunks.set(id, { id, version: of, points, image: photo.image });
    photos.set(photo.image, {
      scale: photo.scale, share: isShare(photo.share) ? photo.share : 1,
      points: own.reduce((n, c) => n + c.points, 0),
    });
  }
  return { submap, version: Number(version) || 0, photos, chunks: [...chunks.values()] };
}

const isShare = (c) => c > 0 && c <= 1;
const isChunk = (c) => Number.isInteger(c?.id) && Number.isInteger(c.version) && Number.isInteger(c.points) && c.points > 0 && c.points <= kMaxChunkPoints;

// Of photos that have a pose and pass `isShown(image)`: image -> {place: submap_from_camera with the scale, spacing}.
// dense: of checkedDense(); cameras: Map(image -> {centre, worldFromCam, aspect}) in the submap's frame.
export function photoPlaces({ photos }, cameras, isShown = () => true) {
  const places = new Map();
  for (const [image, photo] of photos) {
    const camera = cameras.get(image);
    if (!camera || !isShown(image)) continue;
    const { centre: t, worldFromCam: q, aspect } = camera;
    places.set(image, { place: { s: photo.scale, q, t }, spacing: sampleSpacing(photo, aspect) });
  }
  return places;
}

// Distance of neighbouring samples of a depth map over their depth. Its pixels are (points) / (share), in a picture
// of 2 tanX x 2 tanY at depth 1.
export function sampleSpacing({ points, share }, [tanX, tanY]) {
  return points > 0 ? 2 * Math.sqrt((tanX * tanY * share) / points) : 0;
}

// Diameter over depth of the discs that stand for the first `shown` of a chunk's `total` points.
export function discSize(spacing, shown, total) {
  return shown > 0 ? kDiscs * spacing * Math.sqrt(total / shown) : 0;
}

// submap_from_chunk: positions of a chunk are steps from its origin. place: of photoPlaces()
export function chunkPlace(place, { origin, step }) {
  return sim.compose(place, { s: step, q: [1, 0, 0, 0], t: origin });
}

// [x, y] of a point in the photo of a camera {fx, fy, cx, cy} with this pose (cam_from_submap), in px, without distortion;
// null for a point behind the camera.
export function projectPoint(pose, { fx, fy, cx, cy }, point) {
  const [x, y, z] = sim.add(sim.rotate(sim.normalized(pose.slice(0, 4)), point), pose.slice(4, 7));
  return z > 0 ? [(fx * x) / z + cx, (fy * y) / z + cy] : null;
}
