// Keeps the phone's page itself, so that it opens without a network. What it says comes from the server alone.

const kCache = 'skein-phone-1';
const kFiles = ['/phone', '/assets/phone.js', '/assets/phone_style.css', '/assets/icon.svg'];

self.addEventListener('install', (e) => e.waitUntil(caches.open(kCache).then((cache) => cache.addAll(kFiles)).then(() => self.skipWaiting())));
self.addEventListener('activate', (e) => e.waitUntil(
  caches.keys().then((keys) => Promise.all(keys.filter((k) => k.startsWith('skein-phone') && k !== kCache).map((k) => caches.delete(k)))).then(() => self.clients.claim())));
self.addEventListener('fetch', (e) => {
  const { pathname, origin } = new URL(e.request.url);
  if (e.request.method !== 'GET' || origin !== self.location.origin || !kFiles.includes(pathname)) return;
  e.respondWith(fetch(e.request).then(async (answer) => {
    if (answer.ok) await (await caches.open(kCache)).put(pathname, answer.clone());
    return answer;
  }).catch(async () => (await caches.match(pathname)) ?? Response.error()));
});
