// EXIF for photos of the camera view: time, and where and in which direction it was taken. A canvas writes none.

const kAscii = 2, kByte = 1, kLong = 4, kRational = 5;

function entry(tag, type, count, value) {
  return { tag, type, count, value };
}
const ascii = (tag, text) => entry(tag, kAscii, text.length + 1, [...text, '\0'].map((c) => c.charCodeAt(0) & 0x7f));
const u32 = (n) => [n & 255, (n >>> 8) & 255, (n >>> 16) & 255, (n >>> 24) & 255];
const u16 = (n) => [n & 255, n >>> 8];
const rationals = (tag, numbers) => entry(tag, kRational, numbers.length, numbers.flatMap(([v, d]) => [...u32(Math.round(v * d)), ...u32(d)]));

// An image file directory at `offset`, its longer values behind it.
function directory(entries, offset) {
  const head = [...u16(entries.length)], tail = [];
  const tailAt = offset + 2 + 12 * entries.length + 4;
  for (const { tag, type, count, value } of entries) {
    const inline = value.length <= 4 ? [...value, 0, 0, 0, 0].slice(0, 4) : u32(tailAt + tail.length);
    if (value.length > 4) tail.push(...value, ...(value.length % 2 ? [0] : []));
    head.push(...u16(tag), ...u16(type), ...u32(count), ...inline);
  }
  return [...head, 0, 0, 0, 0, ...tail];
}

function angle(tag, degrees) {
  const v = Math.abs(degrees);
  const minutes = (v % 1) * 60;
  return rationals(tag, [[Math.floor(v), 1], [Math.floor(minutes), 1], [(minutes % 1) * 60, 1e6]]);
}

// place: {latitude, longitude, altitude (or null), heading (degrees from north, or null)} or null. taken: utime.
export function exifSegment({ taken, place }) {
  const time = new Date(taken / 1000);
  const two = (n) => String(n).padStart(2, '0');
  const text = `${time.getUTCFullYear()}:${two(time.getUTCMonth() + 1)}:${two(time.getUTCDate())} ${two(time.getUTCHours())}:${two(time.getUTCMinutes())}:${two(time.getUTCSeconds())}`;
  const photo = [ascii(0x9003, text), ascii(0x9011, '+00:00'), ascii(0x9291, String(time.getUTCMilliseconds()).padStart(3, '0'))];
  const gps = place && [
    entry(0, kByte, 4, [2, 3, 0, 0]),
    ascii(1, place.latitude >= 0 ? 'N' : 'S'), angle(2, place.latitude),
    ascii(3, place.longitude >= 0 ? 'E' : 'W'), angle(4, place.longitude),
    ...(place.altitude === null ? [] : [entry(5, kByte, 1, [place.altitude < 0 ? 1 : 0]), rationals(6, [[Math.abs(place.altitude), 1000]])]),
    ...(place.heading === null ? [] : [ascii(16, 'T'), rationals(17, [[((place.heading % 360) + 360) % 360, 100]])]),
  ];
  const image = (photoAt, gpsAt) => directory([
    ascii(0x010f, 'Skein'), ascii(0x0110, 'browser'), entry(0x8769, kLong, 1, u32(photoAt)), ...(gps ? [entry(0x8825, kLong, 1, u32(gpsAt))] : []),
  ], 8);
  const photoAt = 8 + image(0, 0).length;
  const photoBytes = directory(photo, photoAt);
  const gpsAt = photoAt + photoBytes.length;
  const tiff = [0x49, 0x49, 42, 0, ...u32(8), ...image(photoAt, gpsAt), ...photoBytes, ...(gps ? directory(gps, gpsAt) : [])];
  const payload = [0x45, 0x78, 0x69, 0x66, 0, 0, ...tiff];
  const length = payload.length + 2;
  return new Uint8Array([0xff, 0xe1, length >> 8, length & 255, ...payload]);
}

// A JPEG without EXIF with it; anything else as it is.
export async function withExif(blob, about) {
  const start = new Uint8Array(await blob.slice(0, 2).arrayBuffer());
  if (start[0] !== 0xff || start[1] !== 0xd8 || (await hasExif(blob))) return blob;
  return new Blob([blob.slice(0, 2), exifSegment(about), blob.slice(2)], { type: 'image/jpeg' });
}

async function hasExif(blob) {
  const head = new DataView(await blob.slice(0, 64 << 10).arrayBuffer());
  for (let at = 2; at + 10 <= head.byteLength && head.getUint8(at) === 0xff; at += 2 + head.getUint16(at + 2)) {
    const marker = head.getUint8(at + 1);
    if (marker === 0xda) return false;
    if (marker === 0xe1 && head.getUint32(at + 4) === 0x45786966) return true;
  }
  return false;
}
