import assert from 'node:assert/strict';
import { test } from 'node:test';
import { guidanceOf, stationCameras } from '../src/guidance.js';
import { adviceWords, Ghost } from '../src/phone/advice.js';

const timelineWith = (ended, isLive = true) => ({ isLive, live: { submaps: new Map([[1, { ended: false }], [2, { ended }]]) } });
const place = (submap) => ({ submap, good_share: 0.5, verdict: 'weak' });

test('only of maps that live, and of the present', () => {
  const status = { guidance: [place(1), place(2), place(9)], advice: [{ agent: 'alice', submap: 1, stations: [] }, { agent: 'bob', submap: 2 }] };
  const all = guidanceOf({ status, timeline: timelineWith(false) });
  assert.deepEqual(all.guidance.map((g) => g.submap), [1, 2]);
  assert.deepEqual(all.advice.map((a) => a.agent), ['alice', 'bob']);
  assert.deepEqual(all.advice[1].stations, []);
  const merged = guidanceOf({ status, timeline: timelineWith(true) });
  assert.deepEqual(merged.guidance.map((g) => g.submap), [1]);
  assert.deepEqual(merged.advice.map((a) => a.agent), ['alice']);
  assert.deepEqual(guidanceOf({ status, timeline: timelineWith(false, false) }), { guidance: [], advice: [] });
});

test('a status without guidance says nothing', () => {
  for (const status of [null, {}, { guidance: null, advice: 3 }, { guidance: [{ submap: 1, good_share: null }] }]) {
    assert.deepEqual(guidanceOf({ status, timeline: timelineWith(false) }), { guidance: [], advice: [] });
  }
});

test('stations become cameras with what the last photo was taken with', () => {
  const station = (x) => ({ pose: [1, 0, 0, 0, -x, 0, 0], nearest: 4 });
  const advice = [{ agent: 'alice', submap: 1, last_photo: 5, stations: [station(2), { pose: [1, 0, 0, 0, null, 0, 0], nearest: 4 }, station(3)] }];
  const cameras = stationCameras(advice, (submap, image) => (image === 5 ? [0.6, 0.45] : null));
  assert.deepEqual(cameras.map((c) => c.number), [1, 3]);
  assert.deepEqual(cameras[0].centre.map((v) => v + 0), [2, 0, 0]);
  assert.equal(cameras[0].from, 4);
  assert.deepEqual(cameras[0].aspect, [0.6, 0.45]);
  assert.deepEqual(stationCameras(advice, () => null), [], 'no camera is known');
});

test('a phone is told by an arrow, steps where the scale is known, and the sentence', () => {
  const advice = (offset, metres = 0) => ({ working_distance: 4, metres_per_unit: metres, stations: [{ offset, sentence: 'half a metre' }] });
  assert.deepEqual(adviceWords(advice([-2, 0, 0], 0.7)), { arrow: '←', steps: '2 steps to the left', text: 'Half a metre.', from: 0 });
  assert.deepEqual(adviceWords(advice([1, 0, 1])), { arrow: '↗', steps: 'Next photo, forward, to the right', text: 'Half a metre.', from: 0 });
  assert.equal(adviceWords(advice([0, 0, -1], 0.7)).steps, '1 step back');
  assert.deepEqual([[0.1, -3, 0.1], [0.1, 3, 0.1], [0.1, 0.1, 0.1]].map((offset) => adviceWords(advice(offset))).map((w) => [w.arrow, w.steps]),
    [['', 'Next photo, higher'], ['', 'Next photo, lower'], ['', 'Next photo, from the same spot']]);
  assert.equal(adviceWords(advice(null)).steps, 'Next photo');
  for (const none of [null, undefined, {}, { stations: [] }, { stations: [{}] }]) assert.equal(adviceWords(none), null);
});

test('the photo to stand at is fetched once, kept without a network, and dropped for the next one', async () => {
  const asked = [];
  const urls = { made: 0, revoked: 0, createObjectURL: () => `blob:${++urls.made}`, revokeObjectURL: () => urls.revoked++ };
  let answer = async () => ({ ok: true, blob: async () => 'picture' });
  const shown = [];
  const ghost = new Ghost({ changed: () => shown.push(ghost.url), urls, fetch: (path) => { asked.push(path); return answer(); } });
  await ghost.show(7);
  await ghost.show(7);
  assert.deepEqual([asked, ghost.url], [['/api/photos/7/thumbnail'], 'blob:1']);
  answer = async () => ({ ok: false });
  await ghost.show(8); // of somebody else
  await ghost.show(8);
  assert.deepEqual([asked.length, ghost.url, urls.revoked], [2, '', 1]);
  answer = async () => { throw new TypeError('no network'); };
  await ghost.show(9);
  answer = async () => ({ ok: true, blob: async () => 'picture' });
  await ghost.show(9);
  assert.deepEqual([asked.length, ghost.url], [4, 'blob:2']);
  await ghost.show(0);
  assert.deepEqual(shown, ['blob:1', '', 'blob:2', '']);
  assert.equal(urls.revoked, 2);
});

test('a photo that comes late is not that of a later advice', async () => {
  let arrive = null;
  const ghost = new Ghost({
    changed: () => {}, urls: { createObjectURL: (picture) => picture, revokeObjectURL: () => {} },
    fetch: async (path) => (path.includes('/1/') ? new Promise((r) => { arrive = r; }) : { ok: true, blob: async () => 'two' }),
  });
  const first = ghost.show(1);
  await ghost.show(2);
  arrive({ ok: true, blob: async () => 'one' });
  await first;
  assert.equal(ghost.url, 'two');
});
