import assert from 'node:assert/strict';
import { test } from 'node:test';
import { emptyState, fold } from '../src/fold.js';
import { Scales } from '../src/scales.js';

class FakeStorage {
  constructor() {
    this.items = new Map();
  }
  getItem(key) {
    if (this.forbidden) throw new Error('forbidden');
    return this.items.get(key) ?? null;
  }
  setItem(key, value) {
    if (this.forbidden) throw new Error('forbidden');
    this.items.set(key, value);
  }
  removeItem(key) {
    this.items.delete(key);
  }
}

// Two maps; a unit of the second one's frame is 4 of the first one's.
function twoMaps() {
  const state = emptyState();
  fold(state, { seq: 1, t: 1e6, kind: 'submap', submap: 1, state: 'seeded' });
  fold(state, { seq: 2, t: 2e6, kind: 'submap', submap: 2, state: 'seeded' });
  return state;
}
function join(state) {
  const merge = { kind: 'merge', merge: 7, source: 2, target: 1, similarity: [4, 1, 0, 0, 0, 0, 0, 0] };
  fold(state, { ...merge, seq: 3, t: 3e6, state: 'ordered' });
  fold(state, { ...merge, seq: 4, t: 4e6, state: 'done' });
}
const scalesOf = (storage, session = 'a') => {
  const scales = new Scales(storage);
  scales.open(session);
  return scales;
};

test('A scale is kept by session, and other pages hear of it', () => {
  const storage = new FakeStorage();
  const state = twoMaps();
  const [here, there, elsewhere] = [scalesOf(storage), scalesOf(storage), scalesOf(storage, 'b')];
  here.set(state.submaps.get(2), 0.5);
  assert.ok(here.kept);
  assert.deepEqual([...here.bySubmap(state)], [[2, 0.5]]);
  assert.ok(there.heard('skein.scales.a') && !elsewhere.heard('skein.scales.a') && !there.heard('skein.theme'));
  assert.deepEqual([...there.bySubmap(state)], [[2, 0.5]]);
  assert.equal(elsewhere.bySubmap(state).size, 0);
  assert.deepEqual([...scalesOf(storage).bySubmap(state)], [[2, 0.5]]);
  there.forget(state, 2);
  assert.ok(here.heard('skein.scales.a'));
  assert.equal(here.bySubmap(state).size, 0);
  assert.equal(storage.items.size, 0);
});

test('A map that is joined to another one gives it its scale; the latest length counts', () => {
  const state = twoMaps();
  const scales = scalesOf(new FakeStorage());
  scales.set(state.submaps.get(2), 0.5);
  join(state);
  assert.deepEqual([...scales.bySubmap(state)], [[2, 0.5], [1, 0.125]]);
  scales.set(state.submaps.get(1), 0.2);
  assert.equal(scales.bySubmap(state).get(1), 0.2);
  scales.forget(state, 1);
  assert.equal(scales.bySubmap(state).size, 0, 'the scale of the joined map comes back');
});

test('A map that was made anew has no scale', () => {
  const storage = new FakeStorage();
  scalesOf(storage).set(twoMaps().submaps.get(1), 0.5);
  const anew = emptyState();
  fold(anew, { seq: 1, t: 9e6, kind: 'submap', submap: 1, state: 'seeded' });
  assert.equal(scalesOf(storage).bySubmap(anew).size, 0);
});

test('Where the browser keeps nothing it lasts as long as the page; what is spoiled counts as nothing', () => {
  const state = twoMaps();
  const storage = Object.assign(new FakeStorage(), { forbidden: true });
  for (const scales of [scalesOf(storage), scalesOf(null)]) {
    scales.set(state.submaps.get(1), 0.5);
    assert.ok(!scales.kept);
    assert.deepEqual([...scales.bySubmap(state)], [[1, 0.5]]);
  }
  storage.forbidden = false;
  for (const text of ['{', '7', '[null, {"submap": 1}, {"submap": 1, "born": 1000000, "metres": -1}]']) {
    storage.setItem('skein.scales.a', text);
    assert.equal(scalesOf(storage).bySubmap(state).size, 0);
  }
});
