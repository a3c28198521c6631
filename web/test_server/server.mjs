// Serves the page with a synthetic session, by the same protocol as skein-web, without any of Skein's processes:
//
//   node test_server/server.mjs [--port 8471] [--page dist] [--speed 8] [--photos 24] [--points 30000] [--gps] [--at end]
//                               [--hold S[,S ...]] [--depth PX: of the longer side of a photo's depth map; 0: none]
//
// For work on the page, and for tests that need a server which misbehaves: it obeys lines on its standard input
// and answers each when that is done (obeyed drop),
//   drop      closes every WebSocket          silence   swallows events from now on (then tells their head)
//   refuse    answers no request              obey      behaves again
//   mute      takes requests and says nothing, as a server that is out of reach, until it obeys
//   revoke    closes every WebSocket as that of an invitation that was revoked
//   shut      lets nobody in any more: their invitation has expired
//   unasked   refuses to finish, until it obeys
//   full      tells that the disk is full, until it obeys
//   private   gives no photo, as to a phone those of others
//   unadvised tells a phone of no photo to take, until it obeys
//   go        time goes on: with --hold it stands still after each S, in seconds of the session
//
// A phone at /phone is anna's: what it sends counts as received.
import { createHash } from 'node:crypto';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { dirname, extname, join, normalize, resolve } from 'node:path';
import { createInterface } from 'node:readline';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { chunkBytes, denseAt, denseChunkBytes, depthPoints, drawing, guidanceAt, makeSession, meshAt, meshChunkBytes, shapeAt } from './synthetic.mjs';

const { values: options } = parseArgs({
  options: {
    port: { type: 'string', default: '8471' }, page: { type: 'string', default: join(dirname(fileURLToPath(import.meta.url)), '../dist') },
    speed: { type: 'string', default: '8' }, photos: { type: 'string', default: '24' }, points: { type: 'string', default: '30000' },
    gps: { type: 'boolean', default: false }, at: { type: 'string', default: 'start' }, hold: { type: 'string', default: 'Infinity' },
    depth: { type: 'string', default: '60' }, mesh: { type: 'boolean', default: false },
  },
});
const session = makeSession({
  photosEach: Number(options.photos), numPoints: Number(options.points), gps: options.gps, startUtime: Date.now() * 1000 - 1e6,
});
const { events } = session;
const first = events[0].t;
const speed = Number(options.speed);
let began = Date.now();
const holds = options.hold.split(',').map((s) => first + Number(s) * 1e6);
let held = holds.shift();
const running = () => first + (Date.now() - began) * 1000 * speed;
const utimeNow = () => (options.at === 'end' ? Infinity : Math.min(held, running()));
let told = 0; // events so far
let refusing = false;
let muted = false;
let isShut = false;
let silent = false;
let refusesFinish = false;
let advises = true;
let refusesPhotos = false;
let troubles = [];
const sockets = new Set();
const head = () => (told ? events[told - 1].seq : 2);

const kHeaders = {
  'Content-Security-Policy': "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; script-src 'self'",
  'X-Content-Type-Options': 'nosniff', 'Referrer-Policy': 'no-referrer',
};
const kTypes = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };

const uploads = new Set(); // SHA-256s
async function bodyOf(request) {
  let text = '';
  for await (const part of request) text += part;
  return JSON.parse(text || '{}');
}

function send(response, status, body, type = 'application/json', more = {}) {
  response.writeHead(status, { ...kHeaders, 'Content-Type': type, ...more });
  response.end(body);
}
const sendJson = (response, value, status = 200) => send(response, status, JSON.stringify(value));

// Made once a second, as mappers do.
const shapes = new Map();
const dense = new Map(); // submap -> denseAt()
const meshes = new Map(); // submap -> meshAt()
let shapesAt = -1;
function makeShapes() {
  if (shapesAt === told) return;
  shapesAt = told;
  const now = events[told - 1]?.t ?? 0;
  for (const id of [1, 2]) {
    shapes.set(id, shapeAt(session, id, now));
    dense.set(id, Number(options.depth) > 0 ? denseAt(session, id, now, depthOf) : null);
    meshes.set(id, options.mesh ? meshAt(session, id, now) : null);
  }
}

const depths = new Map(); // image -> depthPoints()
function depthOf(photo) {
  if (!depths.has(photo.id)) depths.set(photo.id, depthPoints(session, photo, Number(options.depth)));
  return depths.get(photo.id);
}

function sendRange(request, response, bytes) {
  const range = /^bytes=0-(\d+)$/.exec(request.headers.range ?? '');
  if (range) send(response, 206, bytes.subarray(0, Number(range[1]) + 1), 'application/octet-stream');
  else send(response, 200, bytes, 'application/octet-stream');
}

const routes = [
  [/^\/api\/session$/, (r) => sendJson(r, { session_id: 'synthetic', folder: '/sessions/market street', live: true, version: '0.1.0', head: head(), page_limits: { points: 2000000 }, finishes: true, invites: true, visitor: { role: 'operator', name: 'anna' }, addresses: { secure: `https://127.0.0.1:${options.port}`, plain: '', fingerprint: 'AB:CD' } })],
  [/^\/api\/finish$/, (r) => sendJson(r, ...(refusesFinish ? [{ error: 'ingest does not answer: is it running? Try again' }, 503] : [{ finish: 'requested' }, 202]))],
  [/^\/api\/invitations$/, async (r, _, __, request) => {
    const { name, role } = await bodyOf(request);
    const link = `https://127.0.0.1/#${'x'.repeat(90)}`;
    sendJson(r, { name: name || `${role}-123456`, secure: { link, qr: ['101', '010', '101'] }, plain: null });
  }],
  [/^\/api\/uploads\/states$/, async (r, _, __, request) => {
    const { photos } = await bodyOf(request);
    const { advice } = guidanceAt(session, events[told - 1]?.t ?? 0);
    sendJson(r, {
      states: photos.map(([sha]) => ({ state: uploads.has(sha) ? 'received' : 'unknown' })), troubles,
      advice: (advises && advice.find((a) => a.agent === 'anna')) || null,
    });
  }],
  [/^\/api\/uploads\/([0-9a-f]{64})$/, async (r, [sha], _, request) => {
    const { method, headers } = request;
    if (method === 'HEAD') return send(r, uploads.has(sha) ? 200 : 404, null, 'text/plain', uploads.has(sha) ? { 'Upload-Stored': '1' } : {});
    let bytes = 0;
    for await (const part of request) bytes += part.length;
    const offset = Number(headers['upload-offset']) + bytes;
    const isWhole = offset === Number(headers['upload-length']);
    if (isWhole) uploads.add(sha);
    return send(r, isWhole ? 201 : 200, '', 'text/plain', { 'Upload-Offset': String(offset), ...(isWhole ? { 'Upload-Stored': '1' } : {}) });
  }],
  [/^\/api\/events$/, (r, _, query) => {
    const from = Number(query.get('from') ?? 0);
    sendJson(r, { head: head(), events: events.slice(0, told).filter((e) => e.seq >= from).slice(0, 2000) });
  }],
  [/^\/api\/submaps\/(\d+)$/, (r, [id]) => {
    const shape = shapes.get(Number(id));
    if (shape) sendJson(r, shape.manifest);
    else sendJson(r, { error: 'this submap has no shape' }, 404);
  }],
  [/^\/api\/submaps\/(\d+)\/chunks\/(\d+)$/, (r, [id, chunk], query, request) => {
    const shape = shapes.get(Number(id));
    const found = shape?.chunks.find((c) => c.id === Number(chunk));
    const version = shape?.manifest.chunks.find((c) => c.id === Number(chunk))?.version;
    if (!found || String(version) !== query.get('v')) return sendJson(r, { error: 'gone', version }, 404);
    return sendRange(request, r, chunkBytes(session, shape, { ...found, version }));
  }],
  [/^\/api\/submaps\/(\d+)\/dense$/, (r, [id]) => {
    const surface = dense.get(Number(id));
    if (surface) sendJson(r, surface);
    else sendJson(r, { error: 'this submap has no surface' }, 404);
  }],
  [/^\/api\/submaps\/(\d+)\/dense\/(\d+)$/, (r, [id, chunk], query, request) => {
    const photo = dense.get(Number(id))?.photos.find((p) => p.chunks.some((c) => c.id === Number(chunk)));
    if (!photo || query.get('v') !== '1') return sendJson(r, { error: 'gone', version: photo ? 1 : undefined }, 404);
    return sendRange(request, r, denseChunkBytes(depthOf(session.photos[photo.image - 1]), Number(chunk)));
  }],
  [/^\/api\/submaps\/(\d+)\/mesh$/, (r, [id]) => {
    const mesh = meshes.get(Number(id));
    if (mesh) sendJson(r, mesh);
    else sendJson(r, { error: 'this submap has no mesh' }, 404);
  }],
  [/^\/api\/submaps\/(\d+)\/mesh\/(\d+)$/, (r, [id, image], query) => {
    const chunk = meshes.get(Number(id))?.chunks.find((c) => c.id === Number(image));
    if (String(chunk?.version) !== query.get('v')) return sendJson(r, { error: 'gone', version: chunk?.version }, 404);
    const { pose } = meshes.get(Number(id)).frame.find((p) => p.image === Number(image));
    return send(r, 200, meshChunkBytes(session, session.photos[chunk.id - 1], pose, session.frames[id].s, chunk.version), 'application/octet-stream');
  }],
  [/^\/api\/submaps\/(\d+)\/chunks\/(\d+)\/points\/(\d+)$/, (r, [id, chunk, index]) => {
    const shape = shapes.get(Number(id));
    const point = shape?.chunks.find((c) => c.id === Number(chunk))?.part[Number(index)];
    if (!point) return sendJson(r, { error: 'gone' }, 404);
    const photos = point[1].map((image) => {
      const [x, y] = session.photos[image - 1].seen.get(point[0]);
      return { image, x, y };
    });
    return sendJson(r, { xyz: [0, 0, 0], photos });
  }],
  [/^\/api\/photos\/(\d+)(\/thumbnail)?$/, (r, [id, small]) => {
    const photo = session.photos[Number(id) - 1];
    if (!photo) return sendJson(r, { error: 'no such photo' }, 404);
    if (refusesPhotos) return sendJson(r, { error: 'this invitation is not for that' }, 403);
    return send(r, 200, drawing(session, photo, small ? 320 : session.width), 'image/svg+xml');
  }],
  [/^\/api\/photos\/(\d+)\/matches\/(\d+)$/, (r, [a, b]) => {
    const [pa, pb] = [session.photos[a - 1], session.photos[b - 1]];
    const points = [];
    for (const [i, [x, y]] of pa.seen) if (pb.seen.has(i) && i % 7 === 0) points.push([x, y, ...pb.seen.get(i).slice(0, 2)]);
    sendJson(r, { points });
  }],
];

const server = createServer(async (request, response) => {
  const url = new URL(request.url, 'http://x');
  if (refusing) return request.socket.destroy();
  if (muted) return undefined;
  if (isShut && url.pathname.startsWith('/api/')) return sendJson(response, { error: 'this invitation has expired: ask for another' }, 401);
  for (const [pattern, answer] of routes) {
    const match = pattern.exec(url.pathname);
    if (match) return answer(response, match.slice(1), url.searchParams, request);
  }
  const name = normalize({ '/': '/index.html', '/phone': '/phone.html' }[url.pathname] ?? url.pathname);
  try {
    return send(response, 200, await readFile(join(resolve(options.page), name)), kTypes[extname(name)] ?? 'application/octet-stream');
  } catch {
    return sendJson(response, { error: 'there is no such page' }, 404);
  }
});

function frame(text) {
  const payload = Buffer.from(text);
  const n = payload.length;
  const header = n < 126 ? Buffer.from([0x81, n]) : n < 65536 ? Buffer.from([0x81, 126, n >> 8, n & 255])
    : Buffer.concat([Buffer.from([0x81, 127, 0, 0, 0, 0]), Buffer.from([n >>> 24, (n >> 16) & 255, (n >> 8) & 255, n & 255])]);
  return Buffer.concat([header, payload]);
}
const closing = (code, reason) => Buffer.concat([Buffer.from([0x88, 2 + reason.length, code >> 8, code & 255]), Buffer.from(reason)]);
const tell = (message) => {
  for (const socket of sockets) socket.write(frame(JSON.stringify(message)));
};

server.on('upgrade', (request, socket) => {
  if (refusing || isShut) return socket.destroy();
  const key = createHash('sha1').update(`${request.headers['sec-websocket-key']}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`).digest('base64');
  socket.write(`HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ${key}\r\n\r\n`);
  socket.on('error', () => {});
  socket.on('close', () => sockets.delete(socket));
  socket.on('data', () => {});
  sockets.add(socket);
  socket.write(frame(JSON.stringify({ type: 'hello', session_id: 'synthetic', head: head() })));
  for (const surface of dense.values()) if (surface) socket.write(frame(JSON.stringify(denseMessage(surface))));
});

function denseMessage({ submap, version, photos }) {
  const points = photos.flatMap((p) => p.chunks).reduce((n, c) => n + c.points, 0);
  const triangles = meshes.get(submap)?.chunks.reduce((n, c) => n + c.triangles, 0) ?? 0;
  return { type: 'dense', submap, version, photos: photos.length, points, triangles };
}

// Once every 50 ms: what has happened by now.
let toldHead = 2;
const versions = {};
const denseVersions = {};
function advance() {
  const now = utimeNow();
  const before = told;
  while (told < events.length && events[told].t <= now) told++;
  if (told !== before && !silent) {
    tell({ type: 'events', after: toldHead, head: head(), events: events.slice(before, told) });
    toldHead = head();
  }
}
function tellShapes() {
  makeShapes();
  if (silent) return;
  for (const id of [1, 2]) {
    const shape = shapes.get(id);
    const version = shape?.manifest.version ?? 0;
    if (version === (versions[id] ?? 0)) continue;
    versions[id] = version;
    tell(version ? { type: 'shape', submap: id, version } : { type: 'shape', submap: id, gone: true });
  }
  tellDense();
}
function tellDense() {
  for (const id of [1, 2]) {
    const surface = dense.get(id);
    const version = surface?.version ?? 0;
    if (version === (denseVersions[id] ?? 0)) continue;
    denseVersions[id] = version;
    tell(surface ? denseMessage(surface) : { type: 'dense', submap: id, gone: true });
  }
}
const stateOf = (instance, i) =>
  (instance.startsWith('mapper') ? `map ${i - 3}` : instance === 'ingest' ? 'finishing: waits for 2 photos' : 'idle');
function tellStatus() {
  if (silent) return;
  const now = events[told - 1]?.t ?? 0;
  const waiting = session.photos.filter((p) => p.received <= now && p.placedAt > now).length;
  tell({
    type: 'status', troubles, ...guidanceAt(session, now), backlog: { features: Math.ceil(waiting / 3), retrieval: 0, matching: Math.floor(waiting / 3), mapper: Math.floor(waiting / 3) },
    processes: ['ingest', 'features-1', 'retrieval', 'matching-1', 'mapper-1', 'mapper-2', 'merger'].map((instance, i) => ({
      instance, state: stateOf(instance, i), backlog: i % 3, memory: 40e6 + 30e6 * i, seen_s: 0.4 })),
  });
}
advance();
makeShapes();
setInterval(advance, 50);
setInterval(tellShapes, 1000);
setInterval(tellStatus, 1000);

createInterface({ input: process.stdin }).on('line', (line) => {
  if (line === 'drop') for (const socket of sockets) socket.destroy();
  if (line === 'refuse') refusing = true;
  if (line === 'mute') muted = true;
  if (line === 'shut') isShut = true;
  if (line === 'revoke') for (const socket of sockets) socket.end(closing(1008, 'this invitation was revoked'));
  if (line === 'silence') silent = true;
  if (line === 'unasked') refusesFinish = true;
  if (line === 'unadvised') advises = false;
  if (line === 'private') refusesPhotos = true;
  if (line === 'full') {
    troubles = [{ what: 'On laptop: the disk is almost full: 3 MB are free, 512 MB are needed.', remedy: 'Make room on that computer, on the disk that holds /home/anna/house. Until then new photos wait where they were taken, nothing that was sent is lost, and all goes on by itself.' }];
  }
  if (line === 'go') {
    began += Math.max(0, running() - held) / (1000 * speed);
    held = holds.shift() ?? Infinity;
  }
  if (line === 'obey') {
    refusing = muted = silent = false;
    troubles = [];
    refusesFinish = false;
    advises = true;
    refusesPhotos = false;
    if (toldHead !== head()) tell({ type: 'head', head: head() });
    toldHead = head();
  }
  console.log(`obeyed ${line}`);
});
server.listen(Number(options.port), '127.0.0.1', () => console.log(`ready http://127.0.0.1:${server.address().port}/`));
