// Keeps the phone's page itself, so that it opens without a network, and where the server is out of reach and no answer comes.
// What it says comes from the server alone.

const kCache = 'skein-phone-1';
const kFiles = ['/phone', '/assets/phone.js', '/assets/phone_style.css', '/assets/icon.svg'];
const kPatienceMs = 3000; // a TCP connection to a host that is away takes minutes to fail

self.addEventListener('install', (e) => e.waitUntil(caches.open(kCache).then((cache) => cache.addAll(kFiles)).then(() => self.skipWaiting())));
self.addEventListener('activate', (e) => e.waitUntil(
  caches.keys().then((keys) => Promise.all(keys.filter((k) => k.startsWith('skein-phone') && k !== kCache).map((k) => caches.delete(k)))).then(() => self.clients.claim())));
self.addEventListener('fetch', (e) => {
  const { pathname, origin } = new URL(e.request.url);
  if (e.request.method !== 'GET' || origin !== self.location.origin || !kFiles.includes(pathname)) return;
  const asked = ask(e.request, pathname).catch(() => null);
  e.waitUntil(asked); // an answer that comes late is kept for the next time
  e.respondWith(answerOf(asked, pathname));
});

// Of the server, whole; it is kept if it can be.
async function ask(request, pathname) {
  const answer = await fetch(request);
  if (answer.ok) await caches.open(kCache).then((cache) => cache.put(pathname, answer.clone())).catch(() => {});
  return answer;
}

// asked: the server's answer, or null. What is kept goes out where it does not come in time.
async function answerOf(asked, pathname) {
  const late = new Promise((resolve) => setTimeout(() => resolve(null), kPatienceMs));
  const kept = async () => (await caches.match(pathname)) ?? null;
  return (await Promise.race([asked, late])) ?? (await kept()) ?? (await asked) ?? Response.error();
}
