import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { emptyState, fold, summarize } from '../src/fold.js';
import { uprightPoint, uprightSize } from '../src/orientation.js';
import { ago, area, bytes, explain, finishProgress, finishSeconds, groups, heapWords, height, kLastFinishStep, length, plural, seconds, volume, whatHappens } from '../src/words.js';
import { makeSession } from '../test_server/synthetic.mjs';

const root = new URL('../../', import.meta.url);
const names = (path, from) => [...readFileSync(new URL(path, root), 'utf8').split(from)[1].split('\n}\n')[0].matchAll(/return "([^"]+)"/g)].map((m) => m[1]);
const figures = { reason: 'x', inliers: 17, needed: 30, other: 'alice/1.jpg', brightness: 0.03, blur: 0.5, coverage: 0.2, keypoints: 120 };

test('Each cause that the session tells is explained, with and without its figures', () => {
  const causes = [...names('libs/state/session/diagnosis.cc', 'const char* CauseName('), ...names('libs/state/session/diagnosis.cc', 'const char* TrialCauseName('),
    ...names('libs/state/session/state_names.cc', 'const char* FailureCauseName(')];
  assert.ok(causes.length >= 20, `only ${causes.length} causes were found`);
  for (const cause of causes) {
    if (cause === 'waiting') continue; // no photo that waits is listed
    const { what, help } = explain({ ...figures, cause });
    for (const text of [what, help]) assert.match(text, /^[A-Za-z0-9].*[.?!]$/, cause);
    assert.doesNotMatch(what + help, /undefined|NaN/, cause);
    if (cause !== 'failed') assert.notDeepEqual({ what, help }, explain({ ...figures, cause: 'failed' }), `${cause} has no words`);
  }
});

test('A diagnosis tells its figures; what is known of the past has none', () => {
  assert.equal(explain({ ...figures, cause: 'weak overlap' }).what, '17 of 30 common points with alice/1.jpg.');
  assert.match(explain({ ...figures, inliers: 200, cause: 'weak overlap' }).what, /too little in common/);
  assert.equal(explain({ ...figures, cause: 'few details' }).what, 'Few details: 120 keypoints, on 20 % of the photo.');
  for (const cause of ['no overlap', 'weak overlap', 'similar place', 'contradicted', 'camera', 'not in time', 'other', 'unreadable']) {
    const { what, help } = explain({ cause, reason: '' });
    assert.doesNotMatch(what + help, /undefined|NaN/, cause);
  }
});

test('A format that phones store is told with what to do about it', () => {
  const advice = readFileSync(new URL('libs/images/photo/heif.h', root), 'utf8');
  assert.match(advice, /Settings > Camera > Formats > Most Compatible/);
  assert.match(explain({ cause: 'phone format', reason: '' }).help, /Settings > Camera > Formats > Most Compatible/);
});

test('A failure of a stage, and a cause of a later version, are told by their reason', () => {
  for (const cause of ['failed', 'other', 'the lens is wet', undefined]) assert.equal(explain({ cause, reason: 'the lens is wet' }).what, 'The lens is wet.');
  assert.equal(explain({ cause: 'failed', reason: '' }).what, 'No reason was given.');
});

test('Each state of a finish is a step with words, and no state but done looks idle', () => {
  const states = names('libs/state/session/state_names.cc', 'const char* FinishStateName(').filter((s) => s !== 'deadline' && s !== 'cut');
  assert.ok(states.includes('batch'));
  const told = states.map((state) => finishProgress({ state, cut: false }));
  assert.deepEqual(told.map(({ step }) => step), states.map((_, i) => i));
  assert.equal(told.at(-1).step, kLastFinishStep);
  assert.deepEqual(told.map(({ isRunning }) => isRunning), states.map((state) => state !== 'done'));
  assert.equal(new Set(told.map(({ words }) => words)).size, states.length);
  const later = finishProgress({ state: 'polished', cut: false });
  assert.deepEqual([later.isRunning, later.step], [true, null], 'a state of a later version');
  assert.equal(finishProgress(null).isRunning, false);
  assert.match(finishProgress({ state: 'done', cut: true }).words, /Its time was up/);
});

test('A finish that runs tells when its time is up, in the present alone', () => {
  const finish = { state: 'drained', cut: false, deadline: 95e6 };
  assert.match(finishProgress(finish, 5e6).words, / Its time is up in 90 s: /);
  assert.match(finishProgress(finish, 96e6).words, / Its time is up in 1\.0 s: /, 'the deadline is by the clock of ingest');
  assert.doesNotMatch(finishProgress(finish).words, /time/);
  assert.doesNotMatch(finishProgress({ ...finish, deadline: 0 }, 5e6).words, /time/);
  assert.match(finishProgress({ ...finish, cut: true }, 5e6).words, / Its time is up: /);
});

test('Minutes of a finish are seconds; without any it takes as long as it takes', () => {
  assert.deepEqual(['', ' ', '2', '0.5', '0,5', '0.001', '1440'].map(finishSeconds), [0, 0, 120, 30, 30, 1, 86400]);
  for (const wrong of ['0', '-1', 'soon', '1441', 'Infinity']) assert.equal(finishSeconds(wrong), null, wrong);
});

test('What happens is told in a sentence at each moment of a session', () => {
  const { events } = makeSession({ photosEach: 10, numPoints: 1500 });
  const state = emptyState();
  assert.equal(whatHappens(state, summarize(state), 'live'), 'Waiting for the first photo.');
  const sentences = new Set();
  for (const event of events) {
    fold(state, event);
    const sentence = whatHappens(state, summarize(state), 'live');
    assert.match(sentence, /^[A-Z0-9].*\.$/);
    sentences.add(sentence.replace(/\d+/g, 'N'));
  }
  assert.ok([...sentences].some((s) => s.startsWith('Placing photos')));
  assert.ok([...sentences].some((s) => s.startsWith('Map N is being joined')));
  assert.ok([...sentences].some((s) => s.startsWith('Finishing: a place with several maps')));
  assert.ok([...sentences].some((s) => s.startsWith('Finished. One map')));
});

test('A stored session tells how it ended: nothing goes on in it', () => {
  const { events } = makeSession({ photosEach: 10, numPoints: 1500 });
  const state = emptyState();
  assert.equal(whatHappens(state, summarize(state), 'stored'), 'No photo was sent.');
  const sentences = new Set();
  for (const event of events) {
    fold(state, event);
    const sentence = whatHappens(state, summarize(state), 'stored');
    assert.match(sentence, /^[A-Z0-9].*\.$/);
    assert.doesNotMatch(sentence, /Placing|Finishing|Ready|being joined|Waiting for|every photo placed.*had not/);
    sentences.add(sentence.replace(/\d+/g, 'N'));
  }
  for (const part of [/^No map: /, /photos? had not been tried when it ended/, /^It ended before its finish was done\. One map/, /^Finished\. One map/]) {
    assert.ok([...sentences].some((s) => part.test(s)), `${part}: ${[...sentences].join(' | ')}`);
  }
});

test('Photos that wait for others to be taken are not being placed', () => {
  const state = emptyState();
  const add = (event) => fold(state, { ...event, seq: state.head + 1, t: (state.head + 1) * 1e6 });
  const compared = (image, count, pairs) => [
    { kind: 'photo', image, agent: 'a', name: 'x.jpg' }, { kind: 'described', image, keypoints: 9 }, { kind: 'candidates', image, count }, { kind: 'matched', image, pairs },
  ].forEach(add);
  compared(1, 0, []);
  assert.match(whatHappens(state, summarize(state), 'live'), /^No map yet/);
  compared(2, 1, [[3, 99]]);
  assert.equal(whatHappens(state, summarize(state), 'live'), 'Placing photos: 1 waiting.');
  add({ kind: 'registration', image: 2, submap: 1, state: 'registered' });
  assert.equal(whatHappens(state, summarize(state), 'live'), 'One map. 1 photo waits for others that overlap it. Ready for more.');
});

test('Numbers are short', () => {
  assert.deepEqual([0.04, 1.23, 12.3, 600, 7200].map(seconds), ['40 ms', '1.2 s', '12 s', '10 min', '2.0 h']);
  assert.deepEqual([12, 5200, 1.5e6, 3e9].map(bytes), ['12 B', '5 kB', '1.5 MB', '3.0 GB']);
  assert.deepEqual([length(3.14159, true), length(0.5, true), length(3.14159, false), length(NaN, true)], ['3.14 m', '50 cm', '3.14 units', '–']);
  assert.equal(groups(1234567), '1\u202f234\u202f567');
  assert.deepEqual([plural(1, 'photo'), plural(2, 'photo')], ['1 photo', '2 photos']);
});

test('Areas, volumes and heights are in metres, or in units of the map', () => {
  assert.deepEqual([86.44, 12345, 0.5, 0.002, 0].map((v) => area(v, true)), ['86.4 m²', '12\u202f300 m²', '0.5 m²', '20 cm²', '0 m²']);
  assert.deepEqual([86.44, 0.5, 0.0002].map((v) => volume(v, true)), ['86.4 m³', '0.5 m³', '200 cm³']);
  assert.deepEqual([area(2, false), volume(2, false)], ['2 square units', '2 cubic units']);
  assert.deepEqual([height(1.25, true), height(-0.4, true), height(-2, false)], ['+1.25 m', '−40 cm', '−2 units']);
});

test('A heap is told with what of it has no points, and how dense they are', () => {
  const heap = { area: 20, numPoints: 5210, why: null, cell: 0.05, above: 3, below: 0.001, empty: 0.051 };
  assert.deepEqual(heapWords(heap, { factor: 2, inMetres: true, source: ' (scale from GPS)' }, false), [
    '80 m² (scale from GPS)', '24 m³ above its base, 0.008 m³ below', '6 % of the area has no points', '5\u202f210 points, cells of 10 cm',
  ]);
  assert.deepEqual(heapWords({ ...heap, empty: 0 }, { factor: 1, inMetres: false, source: '' }, true), [
    '20 square units', '3 cubic units above its base, 0.001 cubic units below', '5\u202f210 sparse points, cells of 0.05 units',
  ]);
  assert.deepEqual(heapWords({ area: 20, numPoints: 1, why: 'points' }, { factor: 1, inMetres: true, source: '' }, true), [
    '20 m²', 'no volume: too few points inside', '1 sparse point',
  ]);
});

test('Points of turned photos are upright', () => {
  // The upper left corner as stored is where EXIF says that row 0 and column 0 are; unmirrored it is the upper right one.
  const corner = [[0, 0], [0, 0], [1, 1], [1, 1], [0, 1], [1, 0], [1, 0], [0, 1]];
  corner.forEach((wanted, i) => assert.deepEqual(uprightPoint(i + 1, 0, 0), wanted));
  assert.deepEqual(uprightPoint(6, 1, 0), [1, 1]);
  assert.deepEqual(uprightPoint(8, 1, 0), [0, 0]);
  assert.deepEqual(uprightSize({ width: 4, height: 3, orientation: 6 }), [3, 4]);
  assert.deepEqual(uprightSize({ width: 4, height: 3, orientation: 3 }), [4, 3]);
});

test('How long ago is told in whole seconds', () => {
  assert.deepEqual([0.4, 7, 64.4, 300].map(ago), ['just now', '7 s ago', '64 s ago', '5 min ago']);
});
