import { App } from './app.js';

const app = new App();
app.start();

// For tests and the browser's console.
window.skein = {
  state: () => app.describe(),
  project: (image) => app.viewer.projectCamera(image),
  pickAt: (x, y) => app.viewer.pickAt(x, y),
  pixels: () => app.viewer.samplePixels(),
  select: (image) => app.select(image ? { image } : null),
  showTime: (utime) => app.showTime(utime),
};
