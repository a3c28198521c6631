import assert from 'node:assert/strict';
import test from 'node:test';
import { decodeChunk, pointOf } from '../src/chunk.js';
import { prepareCameras, ranksOf } from '../src/reveal.js';
import { cameraPlace } from '../src/similarity.js';
import { chunkBytes, makeSession, shapeAt } from '../test_server/synthetic.mjs';

test('A point comes with the second camera that sees it', () => {
  const session = makeSession({ photosEach: 10, numPoints: 3000 });
  const shape = shapeAt(session, 1, Infinity);
  const bytes = chunkBytes(session, shape, shape.chunks[0]);
  const chunk = decodeChunk(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  const cameras = shape.manifest.photos.map((p) => ({ ...cameraPlace(p.pose), aspect: [800 / 1300, 600 / 1300] }));
  const order = shape.manifest.photos.map((p) => p.image);
  const points = Array.from({ length: chunk.points }, (_, i) => pointOf(chunk, i));
  const ranks = ranksOf(chunk, prepareCameras(cameras, points));
  // By the photos that truly have it in view: within the depth that the synthetic session gives them.
  let same = 0;
  shape.chunks[0].part.forEach(([, by], i) => {
    const places = by.map((image) => order.indexOf(image)).sort((a, b) => a - b);
    same += ranks[i] === places[1] + 1;
  });
  assert.ok(same > 0.85 * chunk.points, `${same} of ${chunk.points}`);
});

test('A point that no two cameras see is there at the end', () => {
  const chunk = { points: 1, origin: [0, 0, -5], step: 1, position: new Uint16Array(4) };
  const camera = { centre: [0, 0, 0], worldFromCam: [1, 0, 0, 0], aspect: [1, 1] };
  assert.deepEqual([...ranksOf(chunk, prepareCameras([camera, camera, camera], []))], [3]);
  chunk.origin = [0, 0, 5];
  assert.deepEqual([...ranksOf(chunk, prepareCameras([camera, camera, camera], []))], [2]);
});
