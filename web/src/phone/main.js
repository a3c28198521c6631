// The phone's page: takes photos, keeps them, sends them, and tells of each what became of it.
import { doorOf, keepsNothing, kUnreachable } from '../door.js';
import { enter } from '../enter.js';
import { byId, h, keyed, setText } from '../ui/dom.js';
import { showDoor } from '../ui/door.js';
import { showTroubles } from '../ui/troubles.js';
import { bytes as size, explain, groups, plural, sentence, storageWords } from '../words.js';
import { adviceWords, Ghost, showAdvice } from './advice.js';
import { Camera } from './camera.js';
import { keep } from './keep.js';
import { gpsOf, Place } from './place.js';
import { Queue } from './queue.js';
import { ScreenLock } from './screen_lock.js';
import { hasArrived, Uploader, wasSentWhole } from './uploader.js';

const kShown = 120;
const kThumbnailPx = 240;
const kTellThem = 'Tell whoever runs the session.';
const kNewestMs = 60000; // a photo of the file input that was made within this time was made here
const kRetryMs = 3000;
const kKnownPatienceMs = 3000; // of the server, where this phone knows a session
const kPatienceMs = 10000;

const kWords = {
  queued: ['On this phone', 'waits to be sent'],
  sending: ['Sending', ''],
  received: ['Received', 'waits to be taken in'],
  waiting: ['Waiting', 'its place is being looked for'],
  placed: ['Placed', 'in the map'],
};
// Of these photos one has to do something, so their names are shown; as where there is no picture.
const kToFind = new Set(['refused', 'lost', 'failed']);

class PhonePage {
  constructor() {
    this.place = new Place();
    this.camera = new Camera({
      place: this.place,
      take: (blob, name, time) => this.add(blob, name, time, this.place.at(time)),
      said: () => this.show(),
      hint: (isWide) => this.problem || this.storageTrouble || this.trouble || this.ghostHint(isWide),
    });
    this.ghost = new Ghost({ changed: () => this.showGhost() });
    this.wantsGhost = true;
    this.opensOffline = null; // whether this page opens without a network; null: not known yet
    this.urls = new Map(); // sha -> object URL of its thumbnail
    this.connection = { ok: null, why: '' }; // ok: null until the first request is answered or has failed
    this.adding = 0;
    this.problem = '';
    this.storageTrouble = ''; // stays until storing works again
    this.trouble = ''; // the first that a person has to mend
    // Photos may be taken before this browser's storage is open.
    this.opened = new Promise((resolve) => { this.tellOpened = resolve; });
    // While photos are taken or sent.
    this.screenLock = new ScreenLock(() => !document.hidden && (this.camera.open || this.numUnsent() > 0));
  }

  async start() {
    this.keepPage();
    this.wire();
    await this.join();
  }

  // Browsers have workers over https alone, and none where the certificate was only waved through.
  async keepPage() {
    try {
      await navigator.serviceWorker.register('/phone_worker.js');
      await navigator.serviceWorker.ready;
      this.opensOffline = true;
    } catch {
      this.opensOffline = Boolean(navigator.serviceWorker?.controller);
    }
    this.showSecure();
    this.show();
  }

  // The server may be away: the photos of the last session are here, and may be added to.
  async join() {
    const patienceMs = remembered() && !location.hash ? kKnownPatienceMs : kPatienceMs;
    const ask = (path, options) => fetch(path, { ...options, signal: AbortSignal.timeout(patienceMs) });
    try {
      const refusal = await enter({ fetch: ask });
      const answer = await ask('/api/session', { cache: 'no-store' });
      if (answer.status === 401 || answer.status === 403 || refusal) {
        const told = refusal || (await answer.json()).error;
        this.showDoor(doorOf(told));
        return;
      }
      if (!answer.ok) throw new Error(String(answer.status));
      const session = await answer.json();
      remember({ id: session.session_id, folder: session.folder, name: session.visitor?.name ?? '', addresses: session.addresses ?? null });
    } catch {
      if (!remembered()) {
        this.showDoor(kUnreachable);
        setTimeout(() => this.join(), kRetryMs);
        return;
      }
    }
    await this.open(remembered());
  }

  async open(session) {
    byId('door').hidden = true;
    this.session = session;
    setText(byId('folder'), session.folder);
    setText(byId('agent'), session.name);
    this.showSecure();
    try {
      this.queue = await Queue.open(session.id);
    } catch (error) {
      this.showDoor(keepsNothing(error));
      return;
    }
    byId('page').hidden = false;
    globalThis.navigator.storage?.persist?.();
    this.uploader = new Uploader({
      queue: this.queue,
      on: {
        advice: (advice) => this.takeAdvice(advice),
        troubles: (troubles) => {
          showTroubles(byId('troubles'), troubles.map((t) => ({ ...t, remedy: `${t.remedy} ${kTellThem}` })));
          this.trouble = troubles[0]?.what ?? '';
        },
        changed: () => this.soon(),
        storage: (error) => this.setStorage(error),
        connection: (c) => this.setConnection(c),
      },
    });
    this.tellOpened();
    this.show();
    this.uploader.start();
    this.screenLock.ask();
  }

  wire() {
    for (const id of ['take', 'choose']) {
      byId(id).addEventListener('change', async (e) => {
        const files = [...e.target.files];
        e.target.value = '';
        await this.addFiles(files);
      });
    }
    byId('open_camera').addEventListener('click', async () => {
      try {
        await this.camera.start();
        this.problem = '';
        this.screenLock.ask();
      } catch (error) {
        this.problem = error.name === 'NotAllowedError' ? 'The browser may not use the camera: allow it for this page.' : `No camera: ${error.message}`;
      }
      this.show();
    });
    byId('close_camera').addEventListener('click', () => this.camera.stop());
    byId('shutter').addEventListener('click', () => this.camera.press());
    byId('series').addEventListener('click', () => this.camera.setSeries(!this.camera.series));
    byId('ghost_switch').addEventListener('click', () => {
      this.wantsGhost = !this.wantsGhost;
      this.showGhost();
    });
    byId('position').addEventListener('change', (e) => {
      if (e.target.checked) this.place.start((why) => setText(byId('position_note'), why));
      else this.place.stop();
    });
    byId('retry').addEventListener('click', () => this.uploader?.retryNow());
    addEventListener('online', () => this.uploader?.retryNow());
    addEventListener('hashchange', () => location.reload());
    document.addEventListener('visibilitychange', () => {
      if (document.hidden) return;
      this.screenLock.ask();
      if (this.connection.ok === false) this.uploader?.retryNow();
    });
    addEventListener('beforeunload', (e) => {
      if (this.adding > 0 || this.isLostIfLeft()) e.preventDefault();
    });
  }

  async addFiles(files) {
    this.adding += files.length;
    await this.opened;
    this.show();
    for (const file of files) {
      const taken = file.lastModified || Date.now();
      const place = Math.abs(Date.now() - taken) < kNewestMs ? this.place.at(Date.now()) : null;
      // iOS calls each photo of its camera image.jpg.
      const name = /^image\.jpe?g$/i.test(file.name) ? `image-${taken}.jpg` : file.name;
      await this.add(file, name, taken, place);
      this.adding--;
      this.show();
    }
  }

  // Kept on this phone when it ends.
  async add(blob, name, time, place) {
    try {
      const known = await keep(this.queue, blob, { name, taken: Math.round(time * 1000), gps: gpsOf(place), thumbnailOf });
      this.problem = known ? `${known.name} is here already.` : '';
    } catch (error) {
      this.problem = error.name === 'QuotaExceededError' ? `${name} was not kept. ${storageWords(error.name)}` : `${name} was not kept: ${error.message}`;
    }
    this.show();
    this.uploader.pump();
    this.screenLock.ask();
  }

  numUnsent() {
    return this.queue ? [...this.queue.photos.values()].filter((p) => p.state === 'queued' || p.state === 'sending').length : 0;
  }

  // error: why this browser could not write or read what it keeps; null: it can again.
  setStorage(error) {
    this.storageTrouble = error ? storageWords(error.name) : '';
    this.soon();
  }

  setConnection(connection) {
    this.connection = connection;
    if (connection.stopped) this.showDoor(doorOf(connection.why));
    this.soon();
  }

  // No answer comes: the network is away, and the page with it once it is closed.
  isLostIfLeft() {
    return this.isAway() && this.opensOffline !== true;
  }

  isAway() {
    return this.connection.ok === false && !this.connection.stopped && this.connection.why === '';
  }

  soon() {
    this.frame ??= setTimeout(() => {
      this.frame = null;
      this.show();
    }, 60);
  }

  counts() {
    const photos = this.queue ? [...this.queue.photos.values()] : [];
    return {
      taken: photos.length, received: photos.filter((p) => hasArrived(p) || wasSentWhole(p)).length, placed: photos.filter((p) => p.state === 'placed').length,
    };
  }

  show() {
    const counts = this.counts();
    for (const [key, n] of Object.entries(counts)) setText(byId(`count_${key}`), groups(n));
    setText(byId('camera_counts'), `${groups(counts.taken)} taken, ${groups(counts.placed)} placed`);
    const unsent = this.numUnsent();
    this.screenLock.check();
    const words = this.problem || this.storageTrouble || (this.adding > 0 ? `${plural(this.adding, 'photo')} being kept…` : this.connectionWords(unsent));
    setText(byId('note'), words);
    byId('note').classList.toggle('bad', Boolean(this.problem || this.storageTrouble) || (this.connection.ok === false && unsent > 0));
    byId('retry').hidden = this.connection.ok !== false || unsent === 0;
    byId('keep_open').hidden = this.opensOffline !== false;
    byId('keep_open').classList.toggle('bad', this.isLostIfLeft());
    // One way to take photos: the camera view, where there is one.
    byId('open_camera').hidden = !Camera.possible;
    byId('take_label').classList.toggle('primary', !Camera.possible);
    setText(byId('take_words'), Camera.possible ? 'With the phone’s camera app' : 'Take a photo');
    const photos = this.queue ? [...this.queue.photos.values()].reverse() : [];
    byId('none').hidden = photos.length > 0;
    keyed(byId('photos'), photos.slice(0, kShown), (p) => p.sha, (p) => this.makeTile(p), (tile, p) => this.updateTile(tile, p));
    setText(byId('more'), photos.length > kShown ? `And ${plural(photos.length - kShown, 'earlier one')}.` : '');
  }

  // What the guide would have this phone photograph next.
  takeAdvice(advice) {
    const words = adviceWords(advice);
    showAdvice(byId('advice'), words);
    showAdvice(byId('camera_advice'), words);
    this.ghost.show(words?.from ?? 0);
  }

  showGhost() {
    const { url } = this.ghost;
    const picture = byId('ghost');
    if (url) picture.src = url;
    picture.hidden = !url || !this.wantsGhost;
    byId('ghost_switch').hidden = !url;
    byId('ghost_switch').setAttribute('aria-pressed', String(this.wantsGhost));
  }

  ghostHint(isWide) {
    const { hidden, naturalWidth, naturalHeight } = byId('ghost');
    if (hidden || naturalWidth === 0 || (naturalWidth > naturalHeight) === isWide) return '';
    return `The faint photo is ${isWide ? 'upright' : 'wide'}: turn the phone.`;
  }

  connectionWords(unsent) {
    if (this.connection.ok === null) return '';
    if (this.connection.ok && unsent > 0) return `Sending: ${plural(unsent, 'photo')} to go.`;
    if (this.connection.ok) return this.queue.photos.size > 0 ? `Everything is sent.${this.firstWords()}` : 'Connected.';
    if (this.connection.why) return sentence(this.connection.why);
    return unsent > 0 ? `No connection: ${plural(unsent, 'photo waits', 'photos wait')} on this phone, to be sent once it is back.` : 'No connection.';
  }

  // Of a photo that waits alone.
  firstWords() {
    const [first, second] = this.queue.photos.values();
    return first.state === 'waiting' && !second ? ' This photo is placed once another shows about half of the same.' : '';
  }

  makeTile(photo) {
    const picture = photo.thumbnail
      ? h('img', { src: this.urlOf(photo), alt: '', width: 120, height: 120, decoding: 'async' })
      : h('span', { className: 'no_picture', 'aria-hidden': 'true' }, 'no picture');
    return h('li', {}, h('div', { className: 'tile' }, picture, h('span', { className: 'mark', 'aria-hidden': 'true' })),
      h('b'), h('span', { className: 'name' }), h('span', { className: 'what' }), h('small'));
  }

  updateTile(tile, photo) {
    const [word, what, help] = wordsOf(photo, this.connection.ok === false);
    tile.className = `photo ${photo.state}`;
    tile.title = `${photo.name}, ${size(photo.size)}`;
    const [, wordLine, name, whatLine, helpLine] = tile.children;
    setText(wordLine, word);
    setText(name, photo.thumbnail && !kToFind.has(photo.state) ? '' : photo.name);
    setText(whatLine, what);
    setText(helpLine, help);
  }

  urlOf(photo) {
    if (!this.urls.has(photo.sha)) this.urls.set(photo.sha, URL.createObjectURL(photo.thumbnail));
    return this.urls.get(photo.sha);
  }

  showDoor(door) {
    byId('page').hidden = !this.queue;
    const kept = this.numUnsent() > 0 ? ' Photos that wait on this phone are kept, and sent then.' : '';
    showDoor(byId('door'), { ...door, help: door.help + kept });
  }

  // What a page without TLS lacks, or one whose certificate was only waved through, and how to get it.
  showSecure() {
    const addresses = this.session?.addresses;
    const isSecure = isSecureContext && location.protocol === 'https:' && Camera.possible;
    byId('position_part').hidden = !this.place.possible;
    byId('secure').hidden = !addresses || (isSecure && this.opensOffline !== false);
    byId('secure_line').hidden = isSecure;
    if (!addresses) return;
    byId('secure_link').href = `${addresses.secure}/phone`;
    setText(byId('fingerprint'), addresses.fingerprint);
    byId('certificate').href = '/skein.crt';
  }

  describe() {
    return {
      counts: this.counts(), connection: this.connection, adding: this.adding, problem: this.problem, camera: this.camera.open, series: this.camera.running,
      awake: this.screenLock.held, opensOffline: this.opensOffline, ghost: this.ghost.url ? this.ghost.image : 0,
      photos: this.queue ? [...this.queue.photos.values()].map(({ sha, name, state, reason, image, gps, size: n, offset }) => ({ sha, name, state, reason, image, gps, size: n, offset })) : [],
    };
  }
}

// [word, what, what to do]
function wordsOf(photo, isHeldUp) {
  if (photo.state === 'sending' && isHeldUp) return [...kWords.queued, ''];
  if (photo.state === 'sending' && photo.offset > 0) return ['Sending', `${Math.floor((100 * photo.offset) / photo.size)} %`, ''];
  if (photo.state === 'received' && photo.reason) return ['Received', photo.reason, ''];
  const known = kWords[photo.state];
  if (known) return [...known, ''];
  const { what, help } = explain(photo);
  return [{ refused: 'Refused', lost: 'Lost', failed: 'Failed' }[photo.state] ?? 'Not placed', what, help];
}

async function thumbnailOf(blob) {
  const picture = await createImageBitmap(blob, { imageOrientation: 'from-image' });
  const side = Math.min(picture.width, picture.height);
  const canvas = h('canvas', { width: kThumbnailPx, height: kThumbnailPx });
  canvas.getContext('2d').drawImage(picture, (picture.width - side) / 2, (picture.height - side) / 2, side, side, 0, 0, kThumbnailPx, kThumbnailPx);
  picture.close();
  return new Promise((resolve) => canvas.toBlob(resolve, 'image/jpeg', 0.7));
}

const kRemembered = 'skein.phone';
function remember(session) {
  localStorage.setItem(kRemembered, JSON.stringify(session));
}
function remembered() {
  return JSON.parse(localStorage.getItem(kRemembered) ?? 'null');
}

const dark = matchMedia('(prefers-color-scheme: dark)');
const applyTheme = () => { document.documentElement.dataset.theme = dark.matches ? 'dark' : 'light'; };
dark.addEventListener('change', applyTheme);
applyTheme();
const page = new PhonePage();
page.start();

// For tests and the browser's console.
window.skein = { state: () => page.describe(), page };
