// How sharp a small grey picture is, and how far the view has moved between two. Pure functions.

// 8-bit grey of RGBA, width x height.
export function greyOf(rgba) {
  const grey = new Float32Array(rgba.length / 4);
  for (let i = 0; i < grey.length; i++) grey[i] = 0.299 * rgba[4 * i] + 0.587 * rgba[4 * i + 1] + 0.114 * rgba[4 * i + 2];
  return grey;
}

// Variance of the Laplacian (Pech-Pacheco et al., Diatom autofocusing in brightfield microscopy, 2000).
export function sharpnessOf(grey, width, height) {
  let sum = 0, squares = 0, n = 0;
  for (let y = 1; y + 1 < height; y++) {
    for (let x = 1; x + 1 < width; x++) {
      const i = y * width + x;
      const v = grey[i - 1] + grey[i + 1] + grey[i - width] + grey[i + width] - 4 * grey[i];
      sum += v;
      squares += v * v;
      n++;
    }
  }
  return n === 0 ? 0 : squares / n - (sum / n) ** 2;
}

// Shift in pixels, along both axes, at which `b` fits `a` best: least mean absolute difference of the common part, less
// each one's mean brightness. {dx, dy, residual, still}: residual is that difference, still the one without a shift.
export function shiftOf(a, b, width, height, reach) {
  const mean = (g) => g.reduce((s, v) => s + v, 0) / g.length;
  const offset = mean(a) - mean(b);
  const difference = (dx, dy) => {
    let sum = 0, n = 0;
    for (let y = Math.max(0, dy); y < Math.min(height, height + dy); y++) {
      for (let x = Math.max(0, dx); x < Math.min(width, width + dx); x++) {
        sum += Math.abs(a[y * width + x] - b[(y - dy) * width + x - dx] - offset);
        n++;
      }
    }
    return sum / n;
  };
  const still = difference(0, 0);
  let best = { dx: 0, dy: 0, residual: still, still };
  for (let dy = -reach; dy <= reach; dy++) {
    for (let dx = -reach; dx <= reach; dx++) {
      const residual = difference(dx, dy);
      if (residual < best.residual) best = { dx, dy, residual, still };
    }
  }
  return best;
}

// Which frames of a burst are photos: the view has moved by a share of its width since the last photo, and the frame is
// about as sharp as its neighbours.
export class BurstPicker {
  constructor({ minMotion = 0.08, minSharpness = 0.6 } = {}) {
    Object.assign(this, { minMotion, minSharpness });
    this.last = null;
    this.recent = [];
  }

  // {take, motion (share of the width), sharpness, isBlurred}
  look(grey, width, height) {
    const sharpness = sharpnessOf(grey, width, height);
    this.recent = [...this.recent, sharpness].slice(-20);
    const median = [...this.recent].sort((a, b) => a - b)[Math.floor(this.recent.length / 2)];
    const isBlurred = sharpness < this.minSharpness * median;
    let motion = 1;
    if (this.last) {
      const reach = Math.ceil(1.5 * this.minMotion * width);
      const { dx, dy, residual, still } = shiftOf(this.last, grey, width, height, reach);
      // A view that no shift explains is another one.
      motion = residual > 0.75 * still && still > 12 ? 1 : Math.hypot(dx, dy) / width;
    }
    return { take: !isBlurred && motion >= this.minMotion, motion, sharpness, isBlurred };
  }

  // A photo was taken of this frame.
  taken(grey) {
    this.last = grey;
  }
}
