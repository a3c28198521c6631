// The camera view: one shutter, for a photo or for a series that takes one whenever the view has moved, and a word where
// it is blurred.
// Browsers give pages a camera over TLS alone.
import { byId, h, setText } from '../ui/dom.js';
import { withExif } from './exif.js';
import { BurstPicker, greyOf } from './sharpness.js';

const kSmallWidth = 96;
const kLookMs = 250;
const kJpegQuality = 0.93;
const kBlurredShown = 4; // looks

export class Camera {
  // take(blob, name, time): a photo was taken. hint(isWide): what else to say of the view, of that shape
  constructor({ place, take, said, hint }) {
    Object.assign(this, { place, take, said, hint });
    this.small = h('canvas');
    this.stream = null;
    this.starting = false;
    this.series = false; // what the shutter takes
    this.running = false; // a series
    this.blurred = 0;
    this.number = 0;
  }

  static get possible() {
    return Boolean(globalThis.isSecureContext && navigator.mediaDevices?.getUserMedia);
  }

  get open() {
    return this.stream !== null;
  }

  // Throws where the browser gives no camera.
  async start() {
    if (this.stream || this.starting) return;
    this.starting = true;
    try {
      this.stream = await navigator.mediaDevices.getUserMedia({
        audio: false, video: { facingMode: { ideal: 'environment' }, width: { ideal: 4096 }, height: { ideal: 3072 } },
      });
      const video = byId('video');
      video.srcObject = this.stream;
      await video.play();
    } catch (error) {
      this.stop();
      throw error;
    } finally {
      this.starting = false;
    }
    const [track] = this.stream.getVideoTracks();
    track.addEventListener('ended', () => this.stop());
    this.capture = typeof ImageCapture === 'function' ? new ImageCapture(track) : null;
    this.picker = new BurstPicker();
    this.grey = null;
    this.blurred = 0;
    setText(byId('camera_note'), '');
    this.timer = setInterval(() => this.look(), kLookMs);
    byId('camera').hidden = false;
  }

  stop() {
    clearInterval(this.timer);
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    this.stream = null;
    this.setSeries(false);
    byId('video').srcObject = null;
    byId('camera').hidden = true;
    this.said();
  }

  setSeries(on) {
    this.series = on;
    byId('series').setAttribute('aria-pressed', String(on));
    this.setRunning(false);
  }

  setRunning(on) {
    this.running = on;
    const shutter = byId('shutter');
    shutter.className = on ? 'running' : this.series ? 'series' : '';
    shutter.setAttribute('aria-label', on ? 'Stop the series' : this.series ? 'Start the series' : 'Take a photo');
  }

  press() {
    if (this.series) this.setRunning(!this.running);
    else this.shoot();
  }

  async look() {
    const video = byId('video');
    if (!this.stream || this.taking || video.videoWidth === 0 || document.hidden) return;
    const width = kSmallWidth, height = Math.max(8, Math.round((kSmallWidth * video.videoHeight) / video.videoWidth));
    Object.assign(this.small, { width, height });
    const context = this.small.getContext('2d', { willReadFrequently: true });
    context.drawImage(video, 0, 0, width, height);
    const grey = greyOf(context.getImageData(0, 0, width, height).data);
    const seen = this.picker.look(grey, width, height);
    this.grey = grey;
    this.blurred = seen.isBlurred ? kBlurredShown : Math.max(0, this.blurred - 1);
    setText(byId('camera_note'), this.blurred > 0 ? 'Blurred: hold still, or move more slowly.'
      : this.running ? 'Walk slowly: a photo is taken whenever the view has moved.' : this.hint(video.videoWidth > video.videoHeight));
    if (this.running && seen.take) await this.shoot();
  }

  async shoot() {
    if (this.taking || !this.stream) return;
    this.taking = true;
    try {
      const time = Date.now();
      const raw = await this.picture();
      const blob = await withExif(raw, { taken: time * 1000, place: this.place.at(time) });
      if (this.grey) this.picker.taken(this.grey);
      const stamp = new Date(time).toISOString().replace(/[-:]/g, '').replace('T', '-').slice(0, 15);
      await this.take(blob, `skein-${stamp}-${++this.number}.jpg`, time);
    } catch (error) {
      setText(byId('camera_note'), `No photo was taken: ${error.message}`);
    } finally {
      this.taking = false;
    }
  }

  // At full resolution where the browser has it.
  async picture() {
    if (this.capture) {
      try {
        const blob = await this.capture.takePhoto();
        if (blob.type === 'image/jpeg') return blob;
      } catch { /* then the video's frame */ }
    }
    const video = byId('video');
    const canvas = h('canvas', { width: video.videoWidth, height: video.videoHeight });
    canvas.getContext('2d').drawImage(video, 0, 0);
    const blob = await new Promise((resolve) => canvas.toBlob(resolve, 'image/jpeg', kJpegQuality));
    if (!blob) throw new Error('the browser made no picture');
    return blob;
  }
}
