import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { test } from 'node:test';
import vm from 'node:vm';

const source = readFileSync(new URL('../src/phone/worker.js', import.meta.url), 'utf8');
const kPatienceMs = Number(/kPatienceMs = (\d+)/.exec(source)[1]);

// One cache, by path.
class FakeCaches {
  kept = new Map();
  async open() {
    return { put: async (path, answer) => this.kept.set(path, await answer.text()), addAll: async () => {} };
  }
  async match(path) {
    return this.kept.has(path) ? new Response(this.kept.get(path)) : undefined;
  }
}

// The worker with a server: its patience passes at once when `pass` is called.
async function startWorker(answer) {
  const server = createServer(answer);
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const origin = `http://127.0.0.1:${server.address().port}`;
  const listeners = {}, timers = [], caches = new FakeCaches();
  const self = { location: { origin }, addEventListener: (name, f) => { listeners[name] = f; } };
  vm.runInNewContext(source, {
    self, caches, fetch, URL, Response, setTimeout: (f, ms) => {
      assert.equal(ms, kPatienceMs);
      timers.push(f);
    },
  });
  return {
    caches,
    pass: () => timers.splice(0).forEach((f) => f()),
    ask: (path, method = 'GET') => {
      let answered = null, kept = null;
      listeners.fetch({ request: new Request(origin + path, { method }), respondWith: (p) => { answered = p; }, waitUntil: (p) => { kept = p; } });
      return { answered, kept };
    },
    stop: () => {
      server.closeAllConnections();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}

test('A server that takes the connection and says nothing is waited for 3 s, then the kept page opens', async () => {
  assert.equal(kPatienceMs, 3000);
  const silent = [];
  const worker = await startWorker((_, response) => silent.push(response));
  worker.caches.kept.set('/phone', 'the kept page');
  const { answered, kept } = worker.ask('/phone');
  while (silent.length === 0) await new Promise((resolve) => setTimeout(resolve, 5));
  worker.pass();
  assert.equal(await (await answered).text(), 'the kept page');
  // It comes after all, for the next time.
  silent[0].end('a newer page');
  await kept;
  assert.equal(worker.caches.kept.get('/phone'), 'a newer page');
  await worker.stop();
});

test('A server that answers is heard, also late where nothing is kept; without one the kept page opens at once', async () => {
  const waiting = [];
  const worker = await startWorker((request, response) => (request.url === '/phone' ? response.end('the page') : waiting.push(response)));
  assert.equal(await (await worker.ask('/phone').answered).text(), 'the page');
  const late = worker.ask('/assets/phone.js');
  while (waiting.length === 0) await new Promise((resolve) => setTimeout(resolve, 5));
  worker.pass();
  waiting[0].end('the script');
  assert.equal(await (await late.answered).text(), 'the script');
  assert.equal(worker.ask('/api/session').answered, null, 'what the session says is asked of the server alone');
  assert.equal(worker.ask('/phone', 'POST').answered, null);
  await worker.stop();
  assert.equal(await (await worker.ask('/phone').answered).text(), 'the page');
  assert.equal((await worker.ask('/assets/icon.svg').answered).type, 'error');
});
