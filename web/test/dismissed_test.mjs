import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Dismissed } from '../src/dismissed.js';
import { emptyState, fold, notPlacedOf, summarize } from '../src/fold.js';
import { invitedName } from '../src/ui/invite.js';
import { notPlacedWords, retryWords } from '../src/words.js';

class FakeStorage extends Map {
  getItem(key) {
    return this.get(key) ?? null;
  }
  setItem(key, value) {
    this.set(key, value);
  }
  removeItem(key) {
    this.delete(key);
  }
}
const open = (storage, session = 'a') => {
  const dismissed = new Dismissed(storage);
  dismissed.open(session);
  return dismissed;
};

// Photo 1 is placed, 2 matches nothing, 3 is deferred, 4 has no features; a text file was refused.
function session() {
  const state = emptyState();
  const events = [1, 2, 3, 4].map((image) => ({ kind: 'photo', image, agent: 'anna', name: `${image}.jpg`, received: 5e6 }));
  for (const image of [1, 2, 3, 4]) events.push({ kind: 'described', image, keypoints: image === 4 ? 0 : 100 });
  events.push({ kind: 'matched', image: 1, pairs: [] }, { kind: 'matched', image: 2, pairs: [] }, { kind: 'matched', image: 3, pairs: [[1, 40]] });
  events.push({ kind: 'submap', submap: 1, state: 'seeded' }, { kind: 'registration', image: 1, submap: 1, state: 'registered' });
  events.push({ kind: 'registration', image: 3, submap: 1, state: 'deferred', cause: 'weak overlap', reason: 'too few inliers' });
  events.push({ kind: 'failure', image: 0, agent: 'anna', name: 'notes.txt', cause: 'unreadable', reason: 'not a JPEG', parked: true });
  events.forEach((event, i) => fold(state, { ...event, seq: i + 1, t: (10 + i) * 1e6 }));
  return state;
}
const more = (state, event) => fold(state, { ...event, seq: state.head + 1, t: state.utime + 1e6 });

test('What is not placed is what is counted, the newest first and refused ones last; an agent sent all of them', () => {
  const state = session();
  const { notPlaced, placedOf, receivedOf, counts } = summarize(state);
  const list = notPlacedOf(state);
  assert.equal(list.length, notPlaced);
  assert.deepEqual(list.map(({ photo, refused }) => photo?.id ?? refused.name), [4, 3, 2, 'notes.txt']);
  assert.equal(new Set(list.map(({ key }) => key)).size, 4);
  assert.deepEqual([placedOf.get('anna'), receivedOf.get('anna'), counts.received], [1, 5, 5]);
});

test('A photo is dismissed in this browser for this session, and brought back', () => {
  const storage = new FakeStorage();
  const [here, there, other] = [open(storage), open(storage), open(storage, 'b')];
  const [{ key }] = notPlacedOf(session());
  here.set(key, true);
  assert.ok(here.has(key) && here.kept);
  assert.ok(there.heard('skein.dismissed.a') && there.has(key) && !other.has(key));
  assert.ok(open(storage).has(key), 'a reload forgets it');
  there.set(key, false);
  assert.ok(here.heard('skein.dismissed.a') && !here.has(key));
  assert.equal(storage.size, 0);
  storage.setItem('skein.dismissed.a', '[3, null, {"a": 1}, "p2/1"]');
  assert.deepEqual(open(storage).list, ['p2/1']);
});

test('A dismissed photo that is placed after all counts again if it leaves its map', () => {
  const state = session();
  const dismissed = open(new FakeStorage());
  for (const { key } of notPlacedOf(state)) dismissed.set(key, true);
  dismissed.forgetPlaced(state);
  assert.equal(dismissed.list.length, 4);
  more(state, { kind: 'registration', image: 3, submap: 1, state: 'registered' });
  dismissed.forgetPlaced(state);
  assert.equal(dismissed.list.length, 3);
  more(state, { kind: 'registration', image: 3, submap: 1, state: 'withdrawn', cause: 'contradicted', reason: 'contradicted by others' });
  assert.equal(notPlacedOf(state).filter(({ key }) => !dismissed.has(key)).length, 1);
});

test('Trying again is offered where it may find more than before', () => {
  const state = session();
  assert.ok(retryWords(state, 2, true).can);
  assert.ok(!retryWords(state, 2, false).can);
  assert.match(retryWords(state, 2, false).words, /by itself when one that shows the same place is placed/);
  assert.match(retryWords(state, 0, true).words, /None of these can be tried again/);
  more(state, { kind: 'finish', finish: 9, state: 'requested' });
  assert.match(retryWords(state, 2, true).words, /under way/);
  more(state, { kind: 'finish', finish: 9, state: 'done' });
  const done = retryWords(state, 2, true);
  assert.ok(!done.can && /would find the same/.test(done.words));
  more(state, { kind: 'photo', image: 9, agent: 'anna', name: '9.jpg' });
  assert.ok(retryWords(state, 2, true).can, 'a photo came since');
});

test('Photos that are not placed are told in one number, dismissed ones in another', () => {
  assert.equal(notPlacedWords(1, 0), '1 photo not placed.');
  assert.equal(notPlacedWords(4, 1), '3 photos not placed, and 1 dismissed.');
  assert.equal(notPlacedWords(1, 1), '1 photo not placed, and dismissed.');
});

test('A name is as the server takes it', () => {
  const names = ['Anna', 'J\u00fcrgen M\u00fcller', ' robot_2 ', 'a/b\\c', '\u5f20\u4f1f', '', '--', 'x'.repeat(40), `${'x'.repeat(23)} y`];
  const given = names.map(invitedName);
  assert.deepEqual(given, ['Anna', 'Jurgen-Muller', 'robot_2', 'a-b-c', '', '', '', 'x'.repeat(24), 'x'.repeat(23)]);
  for (const name of given) assert.match(name, /^[A-Za-z0-9_-]{0,24}$/);
});
