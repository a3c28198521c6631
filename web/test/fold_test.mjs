import assert from 'node:assert/strict';
import test from 'node:test';
import { bestLink, emptyState, fold, foldUpTo, heirOf, liveSubmaps, notPlacedOf, percentile, standingOf, summarize } from '../src/fold.js';
import { Timeline } from '../src/timeline.js';
import { makeSession } from '../test_server/synthetic.mjs';

// Events with seq and time in the order given, a second apart.
function session(...events) {
  return events.map((e, i) => ({ seq: i + 1, t: 1e15 + i * 1e6, ...e }));
}
const photo = (image, agent = 'a', more = {}) => ({ kind: 'photo', image, agent, name: `${image}.jpg`, width: 4, height: 3, received: 1e15, ...more });
const registration = (image, submap, state, reason = '', cause = 'weak overlap') => ({ kind: 'registration', image, submap, state, cause, reason, pose: [1, 0, 0, 0, 0, 0, 0] });
const foldAll = (events) => events.reduce(fold, emptyState());
const standing = (state, image) => standingOf(state, state.photos.get(image)).standing;

test('A photo goes from waiting to placed', () => {
  const events = session(
    photo(1), { kind: 'described', image: 1, keypoints: 900 }, { kind: 'matched', image: 1, pairs: [[2, 50]] }, registration(1, 7, 'registered'));
  const standings = events.map((_, i) => standing(foldAll(events.slice(0, i + 1)), 1));
  assert.deepEqual(standings, ['waiting', 'waiting', 'waiting', 'placed']);
  const { counts, placedOf, latencies } = summarize(foldAll(events));
  assert.deepEqual(counts, { received: 1, described: 1, matched: 1, placed: 1, waiting: 0, unplaced: 0, failed: 0 });
  assert.equal(placedOf.get('a'), 1);
  assert.equal(latencies[0].s, 3);
});

test('Without keypoints, without overlap and refused photos are not placed, each with its cause', () => {
  const described = (image, keypoints) => ({ kind: 'described', image, keypoints });
  const state = foldAll(session(
    photo(1), described(1, 0), photo(2), described(2, 9), { kind: 'matched', image: 2, pairs: [] },
    photo(3), described(3, 9), { kind: 'matched', image: 3, pairs: [[4, 20]] }, registration(3, 1, 'deferred', 'too few inliers')));
  const standings = [1, 2, 3].map((i) => standingOf(state, state.photos.get(i)));
  assert.deepEqual(standings.map((s) => s.cause), ['few details', 'no overlap', 'weak overlap']);
  assert.deepEqual(standings.map((s) => s.reason), ['', '', 'too few inliers']);
  assert.equal(summarize(state).counts.unplaced, 3);
});

test('The first photo waits for others: nothing was there to compare it with, as diagnosis.cc has it', () => {
  const before = (image, count) => [photo(image), { kind: 'described', image, keypoints: 9 }, { kind: 'candidates', image, count }, { kind: 'matched', image, pairs: [] }];
  const state = foldAll(session(...before(1, 0), ...before(2, 1)));
  assert.deepEqual(standingOf(state, state.photos.get(1)), { standing: 'waiting', reason: 'waits for photos that overlap it', needsOthers: true });
  assert.equal(standingOf(state, state.photos.get(2)).cause, 'no overlap');
  const { counts, needOthers, notPlaced } = summarize(state);
  assert.deepEqual([counts.waiting, needOthers, notPlaced], [1, 1, 1]);
});

test('While it is live a photo stands as the status tells; a place or a failure that events tell comes first', () => {
  const matched = (image) => [photo(image), { kind: 'described', image, keypoints: 9 }, { kind: 'matched', image, pairs: [[9, 40]] }];
  const state = foldAll(session(
    ...matched(1), ...matched(2), ...matched(3), ...matched(4), registration(2, 1, 'registered'), registration(4, 1, 'deferred', 'too few inliers'),
    { kind: 'failure', image: 3, agent: 'a', name: '3.jpg', stage: 's', cause: 'failed', reason: 'x', parked: true }));
  const told = (image, reason = '') => ({ image, cause: 'rotation only', reason, inliers: 40, needed: 30, other: 'a/9.jpg' });
  const diagnoses = new Map([1, 2, 3].map((image) => [image, told(image)]).concat([[4, told(4, 'too few inliers')]]));
  const standings = [1, 2, 3, 4].map((image) => standingOf(state, state.photos.get(image), diagnoses));
  assert.deepEqual(standings.map((s) => [s.standing, s.cause]), [
    ['unplaced', 'rotation only'], ['placed', undefined], ['failed', 'failed'], ['unplaced', 'rotation only']]);
  assert.equal(standings[0].other, 'a/9.jpg');
  assert.equal(standings[3].trial.state, 'deferred');
  assert.equal(standing(state, 1), 'waiting', 'of facts alone');
  assert.equal(summarize(state, diagnoses).notPlaced, notPlacedOf(state, diagnoses).length);
  assert.deepEqual(notPlacedOf(state, diagnoses).map(({ photo: { id } }) => id), [4, 3, 1]);
});

test('A photo that was withdrawn, or whose submap ended, is placed no longer', () => {
  const withdrawn = foldAll(session(
    photo(1), { kind: 'described', image: 1, keypoints: 5 }, { kind: 'matched', image: 1, pairs: [[2, 9]] }, registration(1, 1, 'registered'),
    registration(1, 1, 'withdrawn', 'contradicted by its matches')));
  assert.equal(standing(withdrawn, 1), 'unplaced');
  assert.equal(withdrawn.submaps.get(1).numRegistered, 0);
  const ended = foldAll(session(photo(1), registration(1, 1, 'registered'), { kind: 'submap', submap: 1, state: 'ended', reason: 'too few points' }));
  assert.equal(standing(ended, 1), 'waiting');
  assert.deepEqual(liveSubmaps(ended), []);
});

test('A merge ends its source, and its photos stand in the target', () => {
  const events = session(
    photo(1), photo(2), registration(1, 1, 'registered'), registration(2, 2, 'registered'),
    { kind: 'merge', merge: 5, state: 'ordered', source: 2, target: 1, similarity: [2, 1, 0, 0, 0, 0, 0, 0] },
    registration(2, 1, 'registered'), { kind: 'merge', merge: 5, state: 'done', source: 2, target: 1 });
  const before = foldAll(events.slice(0, 5));
  assert.equal(before.submaps.get(1).openMerge, 5);
  const state = foldAll(events);
  assert.equal(state.submaps.get(2).ended, true);
  assert.equal(state.submaps.get(1).openMerge, 0);
  assert.equal(heirOf(state, 2), 1);
  assert.deepEqual(state.merges.get(5).similarity, [2, 1, 0, 0, 0, 0, 0, 0]);
  assert.equal(summarize(state).counts.placed, 2);
});

test('A merge that is undone leaves both submaps as they were; a failed attempt opens none', () => {
  const state = foldAll(session(
    registration(1, 1, 'registered'), registration(2, 2, 'registered'), { kind: 'merge', merge: 0, state: 'failed', source: 2, target: 1, reason: 'x' },
    { kind: 'merge', merge: 4, state: 'ordered', source: 2, target: 1 }, { kind: 'merge', merge: 4, state: 'undone', source: 2, target: 1, reason: 'y' }));
  assert.deepEqual(liveSubmaps(state).map((s) => [s.id, s.openMerge]), [[1, 0], [2, 0]]);
  assert.equal(state.failedMerges.length, 1);
  assert.equal(state.merges.size, 1);
});

test('Only parked failures count; refused offers count as received; one that came after all does not', () => {
  const failure = (image, name, parked, cause) => ({ kind: 'failure', image, agent: 'a', name, stage: 's', cause, reason: 'x', parked });
  const state = foldAll(session(photo(1), failure(1, '1.jpg', false, 'failed'), failure(0, 'notes.txt', true, 'unreadable'), failure(0, '2.jpg', true, 'vanished')));
  assert.deepEqual(summarize(state).counts, { received: 3, described: 0, matched: 0, placed: 0, waiting: 1, unplaced: 0, failed: 2 });
  fold(state, { seq: 50, t: 2e15, ...photo(2) });
  assert.equal(summarize(state).counts.received, 3);
  fold(state, { seq: 51, t: 2e15, ...failure(1, '1.jpg', true, 'failed') });
  assert.equal(standing(state, 1), 'failed');
  assert.equal(standingOf(state, state.photos.get(1)).cause, 'failed');
});

test('What matched without a verdict is not placed once the session is finished', () => {
  const events = session(
    photo(1), { kind: 'described', image: 1, keypoints: 5 }, { kind: 'matched', image: 1, pairs: [[2, 9]] },
    { kind: 'finish', finish: 1, state: 'requested' }, { kind: 'finish', finish: 1, state: 'cut' }, { kind: 'finish', finish: 1, state: 'done' });
  assert.equal(standing(foldAll(events.slice(0, 5)), 1), 'waiting');
  const state = foldAll(events);
  assert.equal(standing(state, 1), 'unplaced');
  assert.equal(standingOf(state, state.photos.get(1)).cause, 'not in time');
  assert.deepEqual([state.finish.state, state.finish.cut], ['done', true]);
});

test('A finish has the deadline that was set last, and a further finish its own', () => {
  const events = session(
    { kind: 'finish', finish: 1, state: 'requested', deadline: 0 }, { kind: 'finish', finish: 1, state: 'drained' },
    { kind: 'finish', finish: 1, state: 'deadline', deadline: 7e15 }, { kind: 'finish', finish: 1, state: 'settled' },
    { kind: 'finish', finish: 1, state: 'cut' }, { kind: 'finish', finish: 1, state: 'done' }, { kind: 'finish', finish: 9, state: 'requested' });
  const deadlines = events.map((_, i) => foldAll(events.slice(0, i + 1)).finish.deadline);
  assert.deepEqual(deadlines, [0, 0, 7e15, 7e15, 7e15, 7e15, 0]);
  assert.equal(foldAll(events).finish.cut, false);
});

test('The strongest verified pair is told, of both photos', () => {
  const state = foldAll(session(photo(1), photo(2), photo(3), { kind: 'matched', image: 3, pairs: [[1, 20], [2, 70]] }));
  assert.deepEqual(bestLink(state, 3), { image: 2, inliers: 70 });
  assert.deepEqual(bestLink(state, 1), { image: 3, inliers: 20 });
  assert.equal(bestLink(state, 9), null);
});

test('An event twice, of an unknown kind or of unknown photos changes nothing else', () => {
  const events = session(photo(1), { kind: 'weather', image: 1 }, { kind: 'described', image: 99, keypoints: 3 }, { kind: 'constructor' });
  const state = foldAll([...events, ...events]);
  assert.equal(state.agents.get('a').sent, 1);
  assert.equal(state.head, 4);
  assert.equal(state.photos.size, 1);
});

// Of anything, as plain data: maps in their order.
const plain = (v) => v instanceof Map ? [...v].map(([k, x]) => [k, plain(x)]) : Array.isArray(v) ? v.map(plain)
  : v && typeof v === 'object' ? Object.fromEntries(Object.entries(v).map(([k, x]) => [k, plain(x)])) : v;

test('The timeline at any time is the fold up to it, forwards and backwards', () => {
  const { events } = makeSession({ photosEach: 8, numPoints: 1500 });
  const timeline = new Timeline();
  timeline.add(events);
  const times = [0.2, 0.5, 0.9, 0.4, 0.41, 1.1, 0].map((f) => timeline.start + f * (timeline.end - timeline.start));
  for (const t of times) {
    timeline.show(t);
    assert.deepEqual(plain(timeline.shown), plain(foldUpTo(events, t)));
  }
  timeline.show(null);
  assert.equal(timeline.shown, timeline.live);
  assert.equal(timeline.add(events), 0);
  assert.equal(summarize(timeline.live).counts.received, 17);
});

test('Percentiles interpolate', () => {
  assert.equal(percentile([], 50), null);
  assert.equal(percentile([4], 95), 4);
  assert.equal(percentile([3, 1, 2, 4], 50), 2.5);
});
