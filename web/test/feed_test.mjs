import assert from 'node:assert/strict';
import test from 'node:test';
import { Feed } from '../src/feed.js';

// A ledger with a server in front of it, and time that goes by only when told to.
class World {
  constructor(events) {
    this.events = events;
    this.timers = [];
    this.time = 0;
    this.sockets = [];
    this.requests = [];
    this.got = [];
    this.connections = [];
    this.resets = [];
    this.synced = 0;
    this.answering = true;
    const world = this;
    this.feed = new Feed({
      events: (list) => this.got.push(...list.map((e) => e.seq)), reset: (id) => this.resets.push(id), shape: (m) => { this.shape = m; },
      dense: (m) => { this.dense = m; }, status: (s) => { this.status = s; },
      connection: (c) => {
        this.connections.push(c.connected);
        this.refused = c.refused;
      }, synced: () => this.synced++,
    }, {
      url: { http: '', ws: 'ws://x' }, now: () => this.time, random: () => 0.5,
      WebSocket: class {
        constructor() {
          world.sockets.push(this);
        }
        close() {
          this.closed = true;
          this.onclose?.();
        }
      },
      fetch: async (path) => this.answer(path),
      setTimeout: (f, ms) => {
        const timer = { f, at: this.time + ms };
        this.timers.push(timer);
        return timer;
      },
      clearTimeout: (timer) => {
        this.timers = this.timers.filter((t) => t !== timer);
      },
    });
    this.feed.start();
  }
  get socket() {
    return this.sockets[this.sockets.length - 1];
  }
  get head() {
    return this.events[this.events.length - 1] ?? 0;
  }
  async answer(path) {
    this.requests.push(path);
    if (!this.answering) throw new Error('no network');
    if (this.refusal) return { ok: false, status: 401, json: async () => ({ error: this.refusal }) };
    const from = Number(/from=(\d+)/.exec(path)?.[1] ?? 0);
    return { ok: true, json: async () => ({ head: this.head, events: this.events.filter((s) => s >= from).slice(0, 3).map((seq) => ({ seq })) }) };
  }
  say(message) {
    this.socket.onmessage({ data: typeof message === 'string' ? message : JSON.stringify(message) });
  }
  hello() {
    this.say({ type: 'hello', session_id: 's', head: this.head });
  }
  live(after, ...seqs) {
    this.events.push(...seqs);
    this.say({ type: 'events', after, head: this.head, events: seqs.map((seq) => ({ seq })) });
  }
  async settle() {
    for (let i = 0; i < 60; ++i) await null;
  }
  async pass(ms) {
    this.time += ms;
    const due = this.timers.filter((t) => t.at <= this.time);
    this.timers = this.timers.filter((t) => t.at > this.time);
    for (const { f } of due) f();
    await this.settle();
  }
}

test('What was before comes in ranges, then what happens, each once and in order', async () => {
  const world = new World([1, 2, 4, 5, 7, 8, 9]);
  world.hello();
  world.live(9, 10, 11);
  await world.settle();
  world.live(11, 13);
  assert.deepEqual(world.got, [1, 2, 4, 5, 7, 8, 9, 10, 11, 13]);
  assert.equal(world.synced, 1);
  assert.deepEqual(world.resets, ['s']);
});

test('A gap is pulled, also where facts without events lie in it', async () => {
  const world = new World([1, 2]);
  world.hello();
  await world.settle();
  world.events.push(3, 6);
  world.live(6, 8);
  await world.settle();
  assert.deepEqual(world.got, [1, 2, 3, 6, 8]);
});

test('A head without events is pulled', async () => {
  const world = new World([1]);
  world.hello();
  await world.settle();
  world.events.push(2, 3, 4, 5, 6, 7);
  world.say({ type: 'head', head: 7 });
  await world.settle();
  assert.deepEqual(world.got, [1, 2, 3, 4, 5, 6, 7]);
});

test('It reconnects with a growing pause, and goes on where it was', async () => {
  const world = new World([1, 2]);
  world.hello();
  await world.settle();
  world.socket.close();
  assert.equal(world.connections.at(-1), false);
  const pauses = [];
  for (let i = 0; i < 6; ++i) {
    const sockets = world.sockets.length;
    let waited = 0;
    while (world.sockets.length === sockets) {
      await world.pass(100);
      waited += 100;
    }
    pauses.push(waited);
    world.socket.close();
  }
  assert.deepEqual(pauses, [500, 1000, 2000, 4000, 8000, 10000]);
  await world.pass(10000);
  world.events.push(3);
  world.hello();
  await world.settle();
  assert.deepEqual(world.got, [1, 2, 3]);
  assert.deepEqual(world.resets, ['s']);
  assert.equal(world.connections.at(-1), true);
});

test('Where the invitation ended it is told why, and nothing is tried again', async () => {
  const world = new World([1]);
  world.hello();
  await world.settle();
  world.socket.onclose({ code: 1008, reason: 'this invitation was revoked' });
  assert.equal(world.refused, 'this invitation was revoked');
  await world.pass(60000);
  assert.equal(world.sockets.length, 1);
});

test('A handshake that is refused tells no reason: the server is asked', async () => {
  const world = new World([1]);
  world.refusal = 'open the link of your invitation';
  world.socket.onclose({ code: 1006, reason: '' });
  await world.settle();
  assert.equal(world.refused, 'open the link of your invitation');
  await world.pass(60000);
  assert.equal(world.sockets.length, 1);
});

test('Another session, or a ledger that is shorter, begins anew', async () => {
  const world = new World([1, 2, 3]);
  world.hello();
  await world.settle();
  world.events = [1, 2];
  world.hello();
  await world.settle();
  world.say({ type: 'hello', session_id: 'other', head: 2 });
  await world.settle();
  assert.deepEqual(world.resets, ['s', 's', 'other']);
  assert.deepEqual(world.got, [1, 2, 3, 1, 2, 1, 2]);
});

test('Silence is asked about; without an answer the connection counts as lost', async () => {
  const world = new World([1]);
  world.hello();
  await world.settle();
  await world.pass(10001);
  assert.equal(world.feed.connected, true);
  assert.equal(world.requests.at(-1), '/api/session');
  world.answering = false;
  await world.pass(10001);
  assert.equal(world.feed.connected, false);
});

test('A range that cannot be had is asked for again', async () => {
  const world = new World([1, 2]);
  world.answering = false;
  world.hello();
  await world.settle();
  assert.deepEqual(world.got, []);
  world.answering = true;
  await world.pass(1001);
  assert.deepEqual(world.got, [1, 2]);
});

test('Shapes and surfaces are handed on as they are told', () => {
  const world = new World([1]);
  world.hello();
  world.say({ type: 'shape', submap: 1, version: 4 });
  world.say({ type: 'dense', submap: 2, gone: true });
  assert.deepEqual([world.shape.version, world.dense.submap, world.dense.gone], [4, 2, true]);
});

test('What is no message does no harm', async () => {
  const world = new World([1]);
  world.say('}{');
  world.say({ type: 'news' });
  world.hello();
  await world.settle();
  world.say({ type: 'status', backlog: {} });
  assert.deepEqual(world.got, [1]);
  assert.equal(world.status.type, 'status');
});
