import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import test from 'node:test';
import { emptyState, fold, summarize } from '../src/fold.js';
import { uprightPoint, uprightSize } from '../src/orientation.js';
import { advise, bytes, explain, groups, length, plural, seconds, whatHappens } from '../src/words.js';
import { makeSession } from '../test_server/synthetic.mjs';

const root = new URL('../../', import.meta.url);
const sources = (folder) => readdirSync(new URL(folder, root), { withFileTypes: true })
  .filter((f) => f.name.endsWith('.cc') && !f.name.endsWith('_test.cc')).map((f) => readFileSync(new URL(`${folder}/${f.name}`, root), 'utf8'));
const unknown = explain('something new').help;

test('Each reason that the mapping library gives is explained', () => {
  const text = sources('libs/mapping').join('\n');
  const reasons = [...text.matchAll(/Refusal::Cause::\w+,\s*"([^"]+)"/g)].map((m) => m[1]);
  assert.ok(reasons.length >= 12, `only ${reasons.length} reasons were found`);
  for (const reason of reasons) assert.notEqual(explain(reason).help, unknown, reason);
});

test('What the session knows of a photo goes before what its last trial said', () => {
  const told = { what: '17 of 30 inliers with alice/1.jpg', remedy: 'go nearer' };
  assert.deepEqual(advise(told, 'too few inliers'), { what: '17 of 30 inliers with alice/1.jpg.', help: 'Go nearer.' });
  assert.deepEqual(advise(undefined, 'too few inliers'), explain('too few inliers'));
});

test('Each reason that the page itself finds is explained', () => {
  const text = readFileSync(new URL('web/src/fold.js', root), 'utf8');
  const reasons = ['no features', 'no photo overlaps it', 'no submap could take it'];
  for (const reason of reasons) {
    assert.ok(text.includes(`'${reason}'`), `fold.js no longer says "${reason}"`);
    assert.notEqual(explain(reason).help, unknown);
    assert.equal(explain(`${reason}; best link: 34 inliers with a/1.jpg`).what === undefined, false);
  }
});

test('A format that phones store is told with what to do about it', () => {
  const advice = readFileSync(new URL('libs/photo/heif.h', root), 'utf8');
  assert.match(advice, /Settings > Camera > Formats > Most Compatible/);
  const { what, help } = explain('HEIC photo: JPEG, PNG and TIFF are taken. iPhone: ...');
  assert.equal(what, 'Its format is HEIC. This session takes JPEG, PNG and TIFF.');
  assert.match(help, /Settings > Camera > Formats > Most Compatible/);
});

test('An unknown reason is told as it is', () => {
  assert.equal(explain('the lens is wet').what, 'The lens is wet.');
  assert.equal(explain('').what, 'No reason was given.');
});

test('What happens is told in a sentence at each moment of a session', () => {
  const { events } = makeSession({ photosEach: 10, numPoints: 1500 });
  const state = emptyState();
  assert.equal(whatHappens(state, summarize(state), null, true), 'Waiting for the first photo.');
  const sentences = new Set();
  for (const event of events) {
    fold(state, event);
    const sentence = whatHappens(state, summarize(state), null, true);
    assert.match(sentence, /^[A-Z0-9].*\.$/);
    sentences.add(sentence.replace(/\d+/g, 'N'));
  }
  assert.ok([...sentences].some((s) => s.startsWith('Placing photos')));
  assert.ok([...sentences].some((s) => s.startsWith('Map N is being joined')));
  assert.ok([...sentences].some((s) => s.startsWith('Finished. One map')));
});

test('Numbers are short', () => {
  assert.deepEqual([0.04, 1.23, 12.3, 600, 7200].map(seconds), ['40 ms', '1.2 s', '12 s', '10 min', '2.0 h']);
  assert.deepEqual([12, 5200, 1.5e6, 3e9].map(bytes), ['12 B', '5 kB', '1.5 MB', '3.0 GB']);
  assert.deepEqual([length(3.14159, true), length(0.5, true), length(3.14159, false), length(NaN, true)], ['3.14 m', '50 cm', '3.14 units', '–']);
  assert.equal(groups(1234567), '1\u202f234\u202f567');
  assert.deepEqual([plural(1, 'photo'), plural(2, 'photo')], ['1 photo', '2 photos']);
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
