import assert from 'node:assert/strict';
import { createHash, randomBytes } from 'node:crypto';
import { test } from 'node:test';
import { enter } from '../src/enter.js';
import { exifSegment, withExif } from '../src/phone/exif.js';
import { keep } from '../src/phone/keep.js';
import { ScreenLock } from '../src/phone/screen_lock.js';
import { hashOf, Sha256 } from '../src/phone/sha256.js';
import { BurstPicker, sharpnessOf, shiftOf } from '../src/phone/sharpness.js';
import { Uploader } from '../src/phone/uploader.js';
import { explain, storageWords } from '../src/words.js';

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
    this.shut = ''; // why nobody is let in
    this.asked = [];
    this.fetch = (path, options) => this.answer(path, options);
  }

  reply(status, headers = {}, body = {}) {
    return { ok: status < 400, status, headers: new Headers(headers), json: async () => JSON.parse(body === null ? '' : JSON.stringify(body)) };
  }

  async answer(path, { method, headers, body }) {
    if (this.down) throw new TypeError('no connection');
    this.asked.push(method);
    if (!this.shut && path.endsWith('/states')) {
      const { photos } = JSON.parse(body);
      return this.reply(200, {}, { states: photos.map(([id]) => this.states[id] ?? { state: 'received' }) });
    }
    if (this.shut) return this.reply(401, {}, method === 'HEAD' ? null : { error: this.shut }); // whatever is asked
    if (path === '/api/session') return this.reply(200);
    const id = path.split('/').pop();
    const here = this.photos.get(id);
    if (method === 'HEAD') {
      if (!here) return this.reply(404, {}, null);
      return this.reply(200, { 'Upload-Offset': String(here.bytes.length), ...(here.stored ? { 'Upload-Stored': '1' } : {}) }, null);
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
  async add(photo, bytes) {
    this.photos.set(photo.sha, photo);
    this.bytes.set(photo.sha, bytes);
    return true;
  }
  async again(id, changes, bytes) {
    Object.assign(this.photos.get(id), changes);
    this.bytes.set(id, bytes);
  }
}

function uploaderOf(queue, server) {
  const said = [], storage = [];
  const uploader = new Uploader({
    queue, fetch: server.fetch, on: { changed() {}, connection: (c) => said.push(c), storage: (error) => storage.push(error?.name ?? '') },
    setTimeout: (f, ms) => setTimeout(f, Math.min(ms, 15)), clearTimeout,
  });
  Object.assign(uploader, { said, storage });
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
  uploader.said.length = 0;
  await uploader.ask();
  await until('it waits on', () => uploader.said.length > 2);
  assert.ok(uploader.said.every((c) => !c.ok), 'who answers questions is said to take photos');
  server.refusal = [413, {}, { error: 'send it smaller' }];
  await until('it is refused', () => all(queue, 'refused'));
  await until('the connection is told', () => uploader.said.at(-1).ok);
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

test('an invitation that ended stops it, and why is asked where the answer has no body', async () => {
  const queue = new FakeQueue([randomBytes(1000)]), server = new FakeServer();
  server.shut = 'this invitation was revoked';
  const uploader = uploaderOf(queue, server);
  uploader.pump();
  await until('it has stopped', () => uploader.stopped);
  assert.deepEqual(server.asked, ['HEAD', 'GET']);
  assert.ok(uploader.said.some((c) => c.stopped && c.why === 'this invitation was revoked'));
  assert.notEqual([...queue.photos.values()][0].state, 'refused', 'the photo is kept for the next invitation');
  const { length } = server.asked;
  uploader.retryNow();
  await new Promise((r) => setTimeout(r, 60));
  assert.equal(server.asked.length, length, 'it goes on asking');
});

test('a photo that arrives with other bytes is sent once more, then refused with what to do', async () => {
  const queue = new FakeQueue([randomBytes(1000)]), server = new FakeServer();
  server.refusal = [422, {}, { error: 'its bytes have another hash' }];
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('it is refused', () => all(queue, 'refused'));
  await new Promise((r) => setTimeout(r, 60));
  assert.equal(server.asked.filter((m) => m === 'PATCH').length, 2);
  const [photo] = queue.photos.values();
  assert.equal(photo.cause, 'altered');
  assert.match(explain(photo).help, /^Choose it again/);
  uploader.stopped = true;
});

// Reads of it are counted; each gives other bytes, as of a file that an application rewrites.
class ChangingFile extends Blob {
  reads = 0;
  async arrayBuffer() {
    return new Uint8Array([++this.reads, 2, 3]).buffer;
  }
}

test('a file is read once: what is kept has the hash that it is kept by', async () => {
  const queue = new FakeQueue([]), file = new ChangingFile([new Uint8Array(3)]);
  const about = { name: 'a.jpg', taken: 1, gps: null, thumbnailOf: async () => null };
  assert.equal(await keep(queue, file, about), null);
  assert.equal(file.reads, 1);
  const [[id, bytes]] = queue.bytes;
  assert.equal(id, sha(Buffer.from(await bytes.arrayBuffer())));
  await assert.rejects(keep(queue, new Blob([]), about), /empty/);
});

test('a photo that was lost or refused is taken again; others are here already', async () => {
  const bytes = randomBytes(1000);
  const queue = new FakeQueue([bytes]), server = new FakeServer();
  const [photo] = queue.photos.values();
  const choose = () => keep(queue, new Blob([bytes]), { name: 'again.jpg', taken: 2, gps: null, thumbnailOf: async () => null });
  for (const state of ['queued', 'sending', 'received', 'waiting', 'placed', 'unplaced', 'failed']) {
    photo.state = state;
    assert.equal(await choose(), photo, state);
  }
  for (const state of ['lost', 'refused']) {
    Object.assign(photo, { state, reason: 'x', cause: 'altered', offset: 1000 });
    await queue.dropBytes(photo.sha);
    assert.equal(await choose(), null, state);
    assert.deepEqual([photo.state, photo.reason, photo.cause, photo.offset, photo.name, queue.bytes.size], ['queued', '', '', 0, 'again.jpg', 1]);
  }
  // The server's ledger tells the earlier refusal until it has the photo.
  server.states[photo.sha] = { state: 'refused', cause: 'unreadable', reason: 'x' };
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('it is sent', () => server.photos.get(photo.sha)?.stored && photo.state === 'refused');
  server.states[photo.sha] = { state: 'placed', image: 7 };
  await until('it is placed', () => photo.state === 'placed');
  uploader.stopped = true;
});

test('a phone whose storage is full sends what it holds, and tells what is wrong', async () => {
  const queue = new FakeQueue([randomBytes(1000)]), server = new FakeServer();
  const change = queue.change.bind(queue);
  let isFull = true;
  queue.change = async (id, changes) => {
    await change(id, changes);
    if (isFull) throw Object.assign(new Error('full'), { name: 'QuotaExceededError' });
    return true;
  };
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('it is received', () => all(queue, 'received'));
  assert.ok(uploader.storage.every((name) => name === 'QuotaExceededError') && uploader.storage.length > 0);
  assert.match(storageWords(uploader.storage[0]), /free some space/);
  assert.ok(uploader.said.every((c) => c.ok), 'that is no lost connection');
  isFull = false;
  server.states[[...queue.photos.keys()][0]] = { state: 'placed' };
  await until('that it stores again is told', () => uploader.storage.at(-1) === '');
  uploader.stopped = true;
});

test('bytes that the browser does not give are read later, and others are sent meanwhile', async () => {
  const queue = new FakeQueue([randomBytes(1000), randomBytes(1000), randomBytes(1000)]), server = new FakeServer();
  const [broken, ...others] = [...queue.photos.values()];
  const bytesOf = queue.bytesOf.bind(queue);
  let fails = true;
  queue.bytesOf = async (id) => {
    if (fails && id === broken.sha) throw Object.assign(new Error('gone'), { name: 'UnknownError' });
    return bytesOf(id);
  };
  const uploader = uploaderOf(queue, server);
  uploader.start();
  await until('the others are received', () => others.every((p) => p.state === 'received'));
  assert.ok(uploader.said.every((c) => c.ok), 'that is no lost connection');
  assert.equal(uploader.storage[0], 'UnknownError');
  assert.match(storageWords('UnknownError'), /Reload this page/);
  fails = false;
  await until('it is sent, too', () => broken.state === 'received' && uploader.storage.at(-1) === '');
  uploader.stopped = true;
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

test('what became of others is learnt although the bytes of one cannot be read', async () => {
  const queue = new FakeQueue([randomBytes(1000), randomBytes(1000)]), server = new FakeServer();
  const [broken, other] = [...queue.photos.values()];
  for (const photo of [broken, other]) photo.state = 'received';
  const bytesOf = queue.bytesOf.bind(queue);
  queue.bytesOf = async (id) => (id === broken.sha ? Promise.reject(new Error('gone')) : bytesOf(id));
  server.states = { [broken.sha]: { state: 'unknown' }, [other.sha]: { state: 'placed' } };
  const uploader = uploaderOf(queue, server);
  uploader.ask();
  await until('the other is placed', () => other.state === 'placed');
  assert.equal(broken.state, 'received');
  assert.ok(uploader.said.every((c) => c.ok));
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
