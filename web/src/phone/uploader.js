// Sends what is queued, and asks what became of it. A photo is sent in pieces from the offset that the server tells, so
// a lost connection costs what was on its way. services/web/README.md has the protocol.

const kPieceBytes = 1 << 20;
const kPieceMs = 20000; // the server keeps what has come of a piece that takes longer
const kAnswerMs = 10000;
const kAtATime = 2;
const kFirstPauseMs = 500;
const kLongestPauseMs = 8000;
const kAskMs = 2000;
const kAskAllEvery = 10; // rounds
const kAskedAtOnce = 400;

// Of the session from here on: the phone need not keep the bytes.
const kInLedger = new Set(['waiting', 'placed', 'unplaced', 'failed']);
const kDecided = new Set(['placed', 'failed', 'refused', 'lost']);
export const hasArrived = (photo) => photo.state === 'received' || kInLedger.has(photo.state);

// Of a photo that is in no map, as words.js takes them. libs/view/web/diagnosis_json.h tells all but `image`.
const kTold = { reason: '', cause: '', image: 0, inliers: 0, needed: 0, other: '', brightness: 0, blur: 0, coverage: 0, keypoints: 0 };

class Refused extends Error {
  constructor(reason, cause = 'failed') {
    super(reason);
    this.cause = cause;
  }
}
class NotNow extends Error {}

export class Uploader {
  // on: {changed(sha), connection({ok, why}), advice(of the guide or null), troubles([{what, remedy}])}
  constructor({ queue, on, fetch = globalThis.fetch.bind(globalThis), setTimeout = globalThis.setTimeout.bind(globalThis), clearTimeout = globalThis.clearTimeout.bind(globalThis) }) {
    Object.assign(this, { queue, on, fetch, setTimeout, clearTimeout });
    this.sending = new Set();
    this.controls = new Set();
    this.pause = kFirstPauseMs;
    this.timer = null;
    this.askTimer = null;
    this.round = 0;
    this.stopped = false; // the invitation does not hold
  }

  start() {
    this.pump();
    this.ask();
  }

  // The network came back, or the page is seen again.
  retryNow() {
    if (this.stopped) return;
    for (const control of this.controls) control.abort();
    this.pause = kFirstPauseMs;
    this.clearTimeout(this.timer);
    this.timer = null;
    this.pump();
    this.askSoon(0);
  }

  pump() {
    if (this.stopped || this.timer !== null) return;
    for (const photo of this.queue.photos.values()) {
      if (this.sending.size >= kAtATime) return;
      if ((photo.state !== 'queued' && photo.state !== 'sending') || this.sending.has(photo.sha)) continue;
      this.sending.add(photo.sha);
      this.send(photo).then(
        () => this.succeeded(),
        (error) => this.failed(photo, error)).finally(() => {
        this.sending.delete(photo.sha);
        this.pump();
      });
    }
  }

  succeeded() {
    this.pause = kFirstPauseMs;
    this.on.connection({ ok: true, why: '' });
    this.askSoon(300);
  }

  async failed(photo, error) {
    if (error instanceof Refused) {
      await this.change(photo.sha, { state: 'refused', reason: error.message, cause: error.cause });
      return;
    }
    if (this.stopped) return;
    this.on.connection({ ok: false, why: error instanceof NotNow ? error.message : '' });
    if (this.timer !== null) return;
    this.timer = this.setTimeout(() => {
      this.timer = null;
      this.pump();
    }, this.pause);
    this.pause = Math.min(2 * this.pause, kLongestPauseMs);
  }

  async send(photo) {
    const path = `/api/uploads/${photo.sha}`;
    await this.change(photo.sha, { state: 'sending' });
    const bytes = await this.queue.bytesOf(photo.sha);
    if (!bytes) throw new Refused('this phone no longer has it');
    let offset = await this.offsetOf(path);
    while (offset !== null) {
      const piece = bytes.slice(offset, offset + kPieceBytes);
      const headers = {
        'Upload-Offset': String(offset), 'Upload-Length': String(bytes.size), 'Upload-Name': encodeURIComponent(photo.name),
        'Upload-Taken': String(photo.taken),
      };
      if (photo.gps) headers['Upload-Gps'] = [photo.gps[0], photo.gps[1], photo.gps[2] ?? ''].join(',');
      const answer = await this.request(path, { method: 'PATCH', headers, body: piece }, kPieceMs);
      if (answer.ok) {
        this.pause = kFirstPauseMs;
        offset = answer.headers.has('Upload-Stored') ? null : Number(answer.headers.get('Upload-Offset'));
        await this.change(photo.sha, { offset: offset ?? bytes.size });
      } else if (answer.status === 409) {
        const now = await this.offsetOf(path);
        if (now === offset) throw new NotNow('the server is at this photo');
        offset = now;
      } else {
        await this.refuse(answer);
        offset = await this.offsetOf(path);
      }
    }
    await this.change(photo.sha, { state: 'received', reason: '' });
  }

  // What the server has of it; null: all.
  async offsetOf(path) {
    const answer = await this.request(path, { method: 'HEAD' }, kAnswerMs);
    if (answer.status === 404) return 0;
    if (!answer.ok) await this.refuse(answer);
    return answer.headers.has('Upload-Stored') ? null : Number(answer.headers.get('Upload-Offset'));
  }

  // Throws unless the photo is to be sent anew from the start.
  async refuse(answer) {
    const { error } = await answer.json().catch(() => ({ error: `the server answers ${answer.status}` }));
    if (answer.status === 422) return;
    if (answer.status === 401 || answer.status === 403) {
      this.stopped = true;
      this.on.connection({ ok: false, why: error, stopped: true });
      throw new NotNow(error);
    }
    if (answer.status >= 500 || answer.status === 429 || answer.status === 408) throw new NotNow(error);
    throw new Refused(error, answer.status === 413 ? 'too large' : 'failed');
  }

  async request(path, options, patienceMs) {
    const control = new AbortController();
    const timer = this.setTimeout(() => control.abort(), patienceMs);
    this.controls.add(control);
    try {
      return await this.fetch(path, { ...options, signal: control.signal, cache: 'no-store' });
    } finally {
      this.controls.delete(control);
      this.clearTimeout(timer);
    }
  }

  async change(sha, changes) {
    if (await this.queue.change(sha, changes)) this.on.changed(sha);
  }

  askSoon(ms) {
    this.clearTimeout(this.askTimer);
    this.askTimer = this.setTimeout(() => this.ask(), ms);
  }

  // A round that asks of all photos asks also where there are none: whether the server answers.
  async ask() {
    const all = this.round++ % kAskAllEvery === 0;
    const asked = [...this.queue.photos.values()]
      .filter((p) => hasArrived(p) && (all || !kDecided.has(p.state)));
    try {
      if (all && asked.length === 0) await this.askFor([]);
      for (let at = 0; at < asked.length && !this.stopped; at += kAskedAtOnce) await this.askFor(asked.slice(at, at + kAskedAtOnce));
      if ((all || asked.length > 0) && !this.stopped) this.on.connection({ ok: true, why: '' });
    } catch {
      this.round = 0;
      if (!this.stopped) this.on.connection({ ok: false, why: '' });
    }
    if (!this.stopped) this.askSoon(kAskMs);
  }

  async askFor(photos) {
    const answer = await this.request('/api/uploads/states', {
      method: 'POST', headers: { 'Content-Type': 'application/json' },
      body: JSON.stringify({ photos: photos.map((p) => [p.sha, p.name]) }),
    }, kAnswerMs);
    if (!answer.ok) {
      if (answer.status === 401 || answer.status === 403) await this.refuse(answer).catch(() => {});
      throw new NotNow(String(answer.status));
    }
    const { states, advice, troubles } = await answer.json();
    this.on.advice?.(advice ?? null);
    this.on.troubles?.(troubles ?? []);
    for (const [i, told] of states.entries()) await this.learn(photos[i], told);
  }

  async learn(photo, { state, ...told }) {
    if (state === 'unknown' || state === 'receiving') {
      // It was received, and the server's folder has lost it since.
      const bytes = await this.queue.bytesOf(photo.sha);
      await this.change(photo.sha, bytes ? { state: 'queued', reason: '' } : { state: 'lost', cause: 'failed', reason: 'the server no longer has it, nor does this phone' });
      this.pump();
      return;
    }
    if (kInLedger.has(state) && !kInLedger.has(photo.state)) await this.queue.dropBytes(photo.sha);
    const known = Object.entries(kTold).map(([key, none]) => [key, told[key] ?? none]);
    await this.change(photo.sha, { state, ...Object.fromEntries(known) });
  }
}
