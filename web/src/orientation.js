// EXIF orientation: where a point of a photo is in the upright photo. Both in shares of width and height, from the upper
// left corner. Keypoints of a mirrored photo (2, 4, 5, 7) are of its pixels flipped left to right: only a turn is left.
const kUpright = {
  1: (u, v) => [u, v],
  3: (u, v) => [1 - u, 1 - v],
  6: (u, v) => [1 - v, u],
  8: (u, v) => [v, 1 - u],
};
const kRotation = { 2: 1, 4: 3, 5: 8, 7: 6 };

export function uprightPoint(orientation, u, v) {
  return (kUpright[kRotation[orientation] ?? orientation] ?? kUpright[1])(u, v);
}

// Width and height of the upright photo.
export function uprightSize({ width, height, orientation }) {
  return orientation >= 5 && orientation <= 8 ? [height, width] : [width, height];
}
