// A photo's file into the queue. The file is read once: what is hashed is what is kept and sent, whatever becomes of the file.
import { hashOf } from './sha256.js';

const kLongestName = 200;
const kSentAnew = new Set(['lost', 'refused']); // the session has none of these

// Durable when this ends; null. Or the photo of the queue that has these bytes already. about: {name, taken (utime in microseconds),
// gps, thumbnailOf(blob)}
export async function keep(queue, file, { name, taken, gps, thumbnailOf }) {
  if (file.size === 0) throw new Error('it is empty');
  const bytes = new Blob([await file.arrayBuffer()], { type: file.type });
  const sha = await hashOf(bytes);
  const known = queue.photos.get(sha);
  if (known && !kSentAnew.has(known.state)) return known;
  const anew = { name: name.slice(0, kLongestName), size: bytes.size, state: 'queued', reason: '', cause: '', image: 0, offset: 0 };
  if (known) {
    await queue.again(sha, anew, bytes);
    return null;
  }
  const thumbnail = await thumbnailOf(bytes).catch(() => null);
  await queue.add({ sha, ...anew, taken, gps, added: Date.now() + queue.photos.size / 1e6, thumbnail }, bytes);
  return null;
}
