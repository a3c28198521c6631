// Sends what is queued, and asks what became of it. A photo is sent in pieces from the offset that the server tells, so
// a lost connection costs what was on its way. services/web/README.md has the protocol.

const kPieceBytes = 1 << 20;
const kPieceMs = 20000; // the server keeps what has come of a piece that takes longer
const kAnswerMs = 10000;
const kAtATime = 2;
const kFirstPauseMs = 500;
const kLongestPauseMs = 8000;
const kAskMs = 2000;
const kAlteredTwice = 2; // once may be a fault of the way
const kAskAllEvery = 10; // rounds
const kAskedAtOnce = 400;

// Of the session from here on: the phone need not keep the bytes.
const kInLedger = new Set(['waiting', 'placed', 'unplaced', 'failed']);
const kDecided = new Set(['placed', 'failed', 'refused', 'lost']);
// The server may think better of one that it refused before.
export const wasSentWhole = (photo) => photo.state === 'refused' && photo.offset === photo.size;
export const hasArrived = (photo) => photo.state === 'received' || kInLedger.has(photo.state);

const kUnread = Symbol('unread');

// Of a photo that is in no map, as words.js takes them. libs/view/web/diagnosis_json.h tells all but `image`.
const kTold = { reason: '', cause: '', image: 0, inliers: 0, needed: 0, other: '', brightness: 0, blur: 0, coverage: 0, keypoints: 0 };

class Refused extends Error {
  constructor(reason, cause = 'failed') {
    super(reason);
    this.cause = cause;
  }
}
class NotNow extends Error {}
// Of the phone, not of the connection.
class StorageFailed extends Error {}

export class Uploader {
  // on: {changed(sha), connection({ok, why}), storage(error of what this browser cannot store, or null), advice(of the guide or null),
  // troubles([{what, remedy}])}
  constructor({ queue, on, fetch = globalThis.fetch.bind(globalThis), setTimeout = globalThis.setTimeout.bind(globalThis), clearTimeout = globalThis.clearTimeout.bind(globalThis) }) {
    Object.assign(this, { queue, on, fetch, setTimeout, clearTimeout });
    this.sending = new Set();
    this.unreadable = new Set(); // bytes that the browser does not give now
    this.broken = new Set(); // what its storage does not do now
    this.controls = new Set();
    this.pause = kFirstPauseMs;
    this.timer = null;
    this.askTimer = null;
    this.round = 0;
    this.stopped = false; // the invitation does not hold
    this.why = ''; // the server answers, and takes no photo now
  }

  start() {
    this.pump();
    this.ask();
  }

  // The network came back, or the page is seen again.
  retryNow() {
    if (this.stopped) return;
    for (const control of this.controls) control.abort();
    this.unreadable.clear();
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
      if ((photo.state !== 'queued' && photo.state !== 'sending') || this.sending.has(photo.sha) || this.unreadable.has(photo.sha)) continue;
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
    this.why = '';
    this.pause = kFirstPauseMs;
    this.on.connection({ ok: true, why: '' });
    this.askSoon(300);
  }

  async failed(photo, error) {
    if (error instanceof Refused) {
      this.why = '';
      await this.change(photo.sha, { state: 'refused', reason: error.message, cause: error.cause });
      return;
    }
    if (this.stopped) return;
    if (error instanceof StorageFailed) {
      this.readLater(photo.sha);
      return;
    }
    this.why = error instanceof NotNow ? error.message : '';
    this.on.connection({ ok: false, why: this.why });
    if (this.timer !== null) return;
    this.timer = this.setTimeout(() => {
      this.timer = null;
      this.pump();
    }, this.pause);
    this.pause = Math.min(2 * this.pause, kLongestPauseMs);
  }

  // Others are sent meanwhile.
  readLater(sha) {
    this.unreadable.add(sha);
    this.setTimeout(() => {
      this.unreadable.delete(sha);
      this.pump();
    }, kLongestPauseMs);
  }

  async send(photo) {
    const path = `/api/uploads/${photo.sha}`;
    await this.change(photo.sha, { state: 'sending' });
    const bytes = await this.bytesOf(photo.sha);
    if (!bytes) throw new Refused('this phone no longer has it');
    let offset = await this.offsetOf(path);
    let numAltered = 0;
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
      } else if (answer.status === 422 && ++numAltered < kAlteredTwice) {
        offset = await this.offsetOf(path); // from the start
      } else {
        await this.refuse(answer);
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

  // Throws why.
  async refuse(answer) {
    const told = await errorOf(answer);
    if (answer.status === 401 || answer.status === 403) {
      const why = told || (await this.whyNotLetIn());
      this.stopped = true;
      this.on.connection({ ok: false, why, stopped: true });
      throw new NotNow(why);
    }
    const error = told || `the server answers ${answer.status}`;
    if (answer.status === 422) throw new Refused(error, 'altered');
    if (answer.status >= 500 || answer.status === 429 || answer.status === 408) throw new NotNow(error);
    throw new Refused(error, answer.status === 413 ? 'too large' : 'failed');
  }

  // An answer to HEAD has no body; this one has.
  async whyNotLetIn() {
    const answer = await this.request('/api/session', { method: 'GET' }, kAnswerMs);
    return (!answer.ok && (await errorOf(answer))) || 'this invitation is not for sending photos';
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
    const isChanged = await this.stored('change', () => this.queue.change(sha, changes)).catch(() => true);
    if (isChanged) this.on.changed(sha);
  }

  // Throws StorageFailed. The browser's error is told until the same works again. What is sent needs no storage but its bytes, and
  // frees some: who only notes something goes on without.
  async stored(what, act) {
    try {
      const result = await act();
      if (result !== false && this.broken.delete(what) && this.broken.size === 0) this.on.storage?.(null);
      return result;
    } catch (error) {
      this.broken.add(what);
      this.on.storage?.(error);
      throw new StorageFailed(error.message);
    }
  }

  bytesOf(sha) {
    return this.stored('read', () => this.queue.bytesOf(sha));
  }

  askSoon(ms) {
    this.clearTimeout(this.askTimer);
    this.askTimer = this.setTimeout(() => this.ask(), ms);
  }

  // A round that asks of all photos asks also where there are none: whether the server answers.
  async ask() {
    const all = this.round++ % kAskAllEvery === 0;
    const asked = [...this.queue.photos.values()]
      .filter((p) => (hasArrived(p) || wasSentWhole(p)) && (all || !kDecided.has(p.state)));
    try {
      if (all && asked.length === 0) await this.askFor([]);
      for (let at = 0; at < asked.length && !this.stopped; at += kAskedAtOnce) await this.askFor(asked.slice(at, at + kAskedAtOnce));
      if ((all || asked.length > 0) && !this.stopped) this.on.connection({ ok: this.why === '', why: this.why });
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
      if (photo.state === 'refused') return; // servers forget why after a while
      // It was received, and the server's folder has lost it since.
      const bytes = await this.bytesOf(photo.sha).catch(() => kUnread);
      if (bytes === kUnread) return; // it is asked again
      await this.change(photo.sha, bytes ? { state: 'queued', reason: '' } : { state: 'lost', cause: 'failed', reason: 'the server no longer has it, nor does this phone' });
      this.pump();
      return;
    }
    if (kInLedger.has(state) && !kInLedger.has(photo.state)) await this.stored('drop', () => this.queue.dropBytes(photo.sha)).catch(() => {});
    const known = Object.entries(kTold).map(([key, none]) => [key, told[key] ?? none]);
    await this.change(photo.sha, { state, ...Object.fromEntries(known) });
  }
}

// '' where the answer has none.
async function errorOf(answer) {
  return (await answer.json().catch(() => null))?.error ?? '';
}
