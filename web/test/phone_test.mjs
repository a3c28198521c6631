import assert from 'node:assert/strict';
import { createHash, randomBytes } from 'node:crypto';
import { test } from 'node:test';
import { enter } from '../src/enter.js';
import { exifSegment, withExif } from '../src/phone/exif.js';
import { ScreenLock } from '../src/phone/screen_lock.js';
import { hashOf, Sha256 } from '../src/phone/sha256.js';
import { BurstPicker, sharpnessOf, shiftOf } from '../src/phone/sharpness.js';
import { Uploader } from '../src/phone/uploader.js';

const sha = (bytes) => createHash('sha256').update(bytes).digest('hex');

test('SHA-256 is that of others, in whatever parts the bytes come', async () => {
  assert.equal(new Sha256().hex(), sha(''));
  assert.equal(new Sha256().update(new TextEncoder().encode('abc')).hex(), sha('abc'));
  for (const n of [1, 55, 56, 57, 63, 64, 65, 119, 120, 128, 1000, 100_003]) {
    const bytes = randomBytes(n);
    const hash = new Sha256();
    for (let at = 0; at < n; at += 37) hash.update(bytes.subarray(at, Math.min(n, at + 37)));
    assert.equal(hash.hex(), sha(bytes), `${n} bytes`);
    assert.equal(await hashOf(new Blob([bytes]), null), sha(bytes));
    assert.equal(await hashOf(new Blob([bytes])), sha(bytes));
  }
});

// A server that keeps what comes, and loses connections when told to.
class FakeServer {
  constructor() {
    this.photos = new Map();
    this.sent = 0;
    this.cuts = 0; // so many bodies arrive in half
    this.down = false;
    this.states = {};
    this.fetch = (path, options) => this.answer(path, options);
  }

  reply(status, headers = {}, body = {}) {
    return { ok: status < 400, status, headers: new Headers(headers), json: async () => body };
  }

  async answer(path, { method, headers, body }) {
    if (this.down) throw new TypeError('no connection');
    if (path.endsWith('/states')) {
      const { photos } = JSON.parse(body);
      return this.reply(200, {}, { states: photos.map(([id]) => this.states[id] ?? { state: 'received' }) });
    }
    const id = path.split('/').pop();
    const here = this.photos.get(id);
    if (method === 'HEAD') {
      if (!here) return this.reply(404);
      return this.reply(200, { 'Upload-Offset': String(here.bytes.length), ...(here.stored ? { 'Upload-Stored': '1' } : {}) });
    }
    if (this.refusal) return this.reply(...this.refusal);
    const bytes = Buffer.from(await body.arrayBuffer());
    const length = Number(headers['Upload-Length']);
    const before = here?.bytes ?? Buffer.alloc(0);
    if (Number(headers['Upload-Offset']) !== before.length) return this.reply(409, {}, { error: 'go on there' });
    const cut = this.cuts > 0;
    if (cut) this.cuts--;
    const came = cut ? bytes.subarray(0, Math.floor(bytes.length / 2)) : bytes;
    this.sent += came.length;
    const photo = { bytes: Buffer.concat([before, came]), name: decodeURIComponent(headers['Upload-Name']), gps: headers['Upload-Gps'] };
    this.photos.set(id, photo);
    if (cut) throw new TypeError('the connection was lost');
    photo.stored = photo.bytes.length === length && sha(photo.bytes) === id;
    return this.reply(photo.stored ? 201 : 200, { 'Upload-Offset': String(photo.bytes.length), ...(photo.stored ? { 'Upload-Stored': '1' } : {}) });
  }
}

class FakeQueue {
  constructor(contents) {
    this.bytes = new Map(contents.map((b) => [sha(b), new Blob([b])]));
    this.photos = new Map(contents.map((b, i) => [sha(b), { sha: sha(b), name: `ph\u00f6to ${i}.jpg`, size: b.length, taken: 1, gps: i === 1 ? [47.5, 8] : [47.5, 8, 0], state: 'queued', reason: '', image: 0, offset: 0 }]));
  }
  async change(id, changes) {
    Object.assign(this.photos.get(id), changes);
    return true;
  }
  async bytesOf(id) {
    return this.bytes.get(id);
  }
  async dropBytes(id) {
    this.bytes.delete(id);
  }
}

function uploaderOf(queue, server) {
  const said = [];
  const uploader = new Uploader({
    queue, fetch: server.fetch, on: { changed() {}, connection: (c) => said.push(c) },
    setTimeout: (f, ms) => setTimeout(f, Math.min(ms, 15)), clearTimeout,
  });
  uploader.said = said;
  return uploader;
}

async function until(what, holds) {
  for (const end = Date.now() + 5000; !holds();) {
    assert.ok(Date.now() < end, what);
    await new Promise((r) => setTimeout(r, 5));
  }
}
const all = (queue, state) => [...queue.photos.values()].every((p) => p.state === state);

test('photos go on where the connection was lost, and no byte is sent twice', async () => {
  const contents = Array.from({ length: 6 }, () => randomBytes(2_500_000));
  const queue = new FakeQueue(contents), server = new FakeServer();
  server.cuts = 3;
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('all are received', () => all(queue, 'received'));
  uploader.stopped = true;
  for (const bytes of contents) assert.deepEqual(server.photos.get(sha(bytes)).bytes, bytes);
  assert.equal(server.sent, 6 * 2_500_000);
  assert.equal(server.photos.get(sha(contents[0])).name, 'ph\u00f6to 0.jpg');
  assert.equal(server.photos.get(sha(contents[0])).gps, '47.5,8,0');
  assert.equal(server.photos.get(sha(contents[1])).gps, '47.5,8,');
});

test('a dead server is waited for; what it refuses is told', async () => {
  const queue = new FakeQueue([randomBytes(1000)]), server = new FakeServer();
  server.down = true;
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('no connection is told', () => uploader.said.some((c) => !c.ok));
  server.down = false;
  server.refusal = [503, {}, { error: 'the disk is full' }];
  await until('why it waits is told', () => uploader.said.some((c) => c.why === 'the disk is full'));
  server.refusal = [413, {}, { error: 'send it smaller' }];
  await until('it is refused', () => all(queue, 'refused'));
  const [refused] = queue.photos.values();
  assert.deepEqual([refused.reason, refused.cause], ['send it smaller', 'too large']);
  uploader.stopped = true;
});

test('without a photo the phone learns whether the server answers', async () => {
  const server = new FakeServer();
  const uploader = uploaderOf(new FakeQueue([]), server);
  uploader.start();
  await until('the connection is told', () => uploader.said.length > 0);
  assert.ok(uploader.said.every((c) => c.ok), 'nothing failed');
  server.down = true;
  await until('it is lost', () => !uploader.said.at(-1).ok);
  server.down = false;
  await until('it is back', () => uploader.said.at(-1).ok);
  uploader.stopped = true;
});

test('an invitation that ended stops it', async () => {
  const queue = new FakeQueue([randomBytes(1000)]), server = new FakeServer();
  server.refusal = [401, {}, { error: 'open the link of your invitation' }];
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('it has stopped', () => uploader.stopped);
  assert.ok(uploader.said.some((c) => c.stopped && /invitation/.test(c.why)));
  assert.notEqual([...queue.photos.values()][0].state, 'refused', 'the photo is kept for the next invitation');
});

test('bytes stay on the phone until the ledger has the photo, and are sent again where the server lost it', async () => {
  const bytes = randomBytes(1000);
  const queue = new FakeQueue([bytes]), server = new FakeServer();
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('it is received', () => all(queue, 'received'));
  assert.ok(queue.bytes.has(sha(bytes)));
  server.photos.clear();
  server.states[sha(bytes)] = { state: 'unknown' };
  await until('it is sent again', () => server.photos.size === 1);
  server.states[sha(bytes)] = { state: 'placed', image: 7 };
  await until('it is placed', () => all(queue, 'placed'));
  assert.ok(!queue.bytes.has(sha(bytes)));
  uploader.stopped = true;
});

function pattern(width, height, dx, soft) {
  const grey = new Float32Array(width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const u = x + dx;
      grey[y * width + x] = 128 + 60 * Math.sin(u * 0.9 * soft + y * 0.3) + 40 * Math.sin(u * 0.37 - y * 0.71 * soft);
    }
  }
  return grey;
}

test('a blurred frame is told apart, and a shift is found', () => {
  assert.ok(sharpnessOf(pattern(96, 54, 0, 1), 96, 54) > 3 * sharpnessOf(pattern(96, 54, 0, 0.3), 96, 54));
  const { dx, dy } = shiftOf(pattern(96, 54, 0, 1), pattern(96, 54, 5, 1), 96, 54, 8);
  assert.deepEqual([Math.abs(dx), dy], [5, 0]);
});

test('a series takes a photo when the view has moved, and none of a blurred frame', () => {
  const picker = new BurstPicker();
  const frame = (dx, soft = 1) => {
    const grey = pattern(96, 54, dx, soft);
    const seen = picker.look(grey, 96, 54);
    if (seen.take) picker.taken(grey);
    return seen;
  };
  assert.ok(frame(0).take, 'the first');
  for (const dx of [0, 1, 3]) assert.ok(!frame(dx).take, `moved by ${dx}`);
  assert.ok(!frame(9, 0.3).take, 'blurred');
  assert.ok(frame(9).take, 'moved by 9 of 96');
});

test('EXIF tells time, place and direction, and stands where none was', async () => {
  const about = { taken: Date.UTC(2026, 6, 1, 12, 30, 15, 250) * 1000, place: { latitude: -33.8568, longitude: 151.2153, altitude: 12.5, heading: -90 } };
  const jpeg = new Blob([new Uint8Array([0xff, 0xd8, 0xff, 0xdb, 0, 4, 1, 2, 0xff, 0xda])]);
  const made = new Uint8Array(await (await withExif(jpeg, about)).arrayBuffer());
  const text = Buffer.from(made).toString('latin1');
  assert.ok(text.includes('2026:07:01 12:30:15\0'));
  assert.equal(made[0] * 256 + made[1], 0xffd8);
  assert.equal(made.length, jpeg.size + exifSegment(about).length);
  const again = new Blob([made]);
  assert.equal(await withExif(again, about), again, 'it has one already');
  const noJpeg = new Blob(['x']);
  assert.equal(await withExif(noJpeg, about), noJpeg);
});

test('the pass is shown once and leaves the address bar', async () => {
  const asked = [], replaced = [];
  const fetch = async (path, options) => {
    asked.push([path, options]);
    return { ok: true, status: 200, json: async () => ({}) };
  };
  const pass = 'a'.repeat(130);
  const history = { replaceState: (...a) => replaced.push(a[2]) };
  assert.equal(await enter({ fetch, location: { hash: `#${pass}`, pathname: '/phone' }, history }), '');
  assert.deepEqual(asked.map(([path, o]) => [path, o.method, JSON.parse(o.body).pass]), [['/api/enter', 'POST', pass]]);
  assert.deepEqual(replaced, ['/phone']);
  assert.equal(await enter({ fetch, location: { hash: '#tab', pathname: '/' }, history }), '');
  assert.equal(asked.length, 1, 'other fragments are no passes');
  const refused = async () => ({ ok: false, status: 401, json: async () => ({ error: 'it has expired' }) });
  assert.equal(await enter({ fetch: refused, location: { hash: `#${pass}`, pathname: '/' }, history }), 'it has expired');
});

// A browser's wake locks: granted when told, taken back when the page is hidden.
class FakeLocks {
  constructor() {
    this.asked = [];
    this.given = [];
  }

  request() {
    return new Promise((give, refuse) => this.asked.push({ give: () => give(this.make()), refuse }));
  }

  make() {
    const lock = Object.assign(new EventTarget(), { released: false });
    lock.release = () => {
      lock.released = true;
      lock.dispatchEvent(new Event('release'));
    };
    this.given.push(lock);
    return lock;
  }
}

test('one lock keeps the screen on, and none is left when nothing is done any more', async () => {
  const locks = new FakeLocks();
  let wanted = false;
  const screen = new ScreenLock(() => wanted, locks);
  await screen.ask();
  assert.equal(locks.asked.length, 0);
  wanted = true;
  let asking = [screen.ask(), screen.ask()];
  assert.equal(locks.asked.length, 1, 'two who ask at once get two locks');
  locks.asked[0].give();
  await Promise.all(asking);
  assert.ok(screen.held);
  locks.given[0].release(); // hidden
  assert.ok(!screen.held);
  asking = [screen.ask()];
  locks.asked[1].give();
  await asking[0];
  wanted = false;
  screen.check();
  assert.ok(!screen.held && locks.given.every((lock) => lock.released));
  // All is done before the browser has answered.
  wanted = true;
  asking = [screen.ask()];
  wanted = false;
  locks.asked[2].give();
  await asking[0];
  assert.ok(!screen.held && locks.given[2].released);
  // Refused, then given.
  wanted = true;
  asking = [screen.ask()];
  locks.asked[3].refuse(new Error('battery'));
  await asking[0];
  assert.ok(!screen.held);
  asking = [screen.ask()];
  locks.asked[4].give();
  await asking[0];
  assert.ok(screen.held);
  await new ScreenLock(() => true, undefined).ask(); // pages without TLS have no locks
});
