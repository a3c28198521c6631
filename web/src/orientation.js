// EXIF orientation: where a point of the photo as stored is in the upright photo. Both in shares of width and height,
// from the upper left corner.
const kUpright = {
  1: (u, v) => [u, v],
  2: (u, v) => [1 - u, v],
  3: (u, v) => [1 - u, 1 - v],
  4: (u, v) => [u, 1 - v],
  5: (u, v) => [v, u],
  6: (u, v) => [1 - v, u],
  7: (u, v) => [1 - v, 1 - u],
  8: (u, v) => [v, 1 - u],
};

export function uprightFromStored(orientation, u, v) {
  return (kUpright[orientation] ?? kUpright[1])(u, v);
}

// Width and height of the upright photo.
export function uprightSize({ width, height, orientation }) {
  return orientation >= 5 && orientation <= 8 ? [height, width] : [width, height];
}
