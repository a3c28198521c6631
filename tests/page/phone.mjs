// The phone's side of tests/process/phone_test.sh: node phone.mjs LINKS STEPS PHOTOS, where LINKS holds a line NAME LINK for
// each invitation, and PHOTOS is a folder of an agent's photos.
import assert from 'node:assert/strict';
import { existsSync, readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { contrastFaults, expectClean, openBrowser } from './browser.mjs';

const [linksFile, steps, photosDir, film] = process.argv.slice(2);
const links = Object.fromEntries(readFileSync(linksFile, 'utf8').trim().split('\n').map((line) => line.split(' ')));
const photos = readdirSync(photosDir).sort().map((name) => join(photosDir, name));
const told = (name) => writeFileSync(join(steps, name), '');
async function heard(name, deadlineS = 120) {
  for (const end = Date.now() + deadlineS * 1000; !existsSync(join(steps, name));) {
    assert.ok(Date.now() < end, `not within ${deadlineS} s: ${name}`);
    await new Promise((r) => setTimeout(r, 100));
  }
}
const phone = { width: 390, height: 844 };
const fakeCamera = (film) => ['--ignore-certificate-errors', '--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream', `--use-file-for-fake-video-capture=${film}`];

// A JPEG of it, 640 px wide, blurred over so many px.
const redrawn = async (page, photo, blurPx) => Buffer.from(await page.evaluate(async ([base64, blur]) => {
  const image = await createImageBitmap(await (await fetch(`data:image/jpeg;base64,${base64}`)).blob());
  const canvas = Object.assign(document.createElement('canvas'), { width: 640, height: Math.round((640 * image.height) / image.width) });
  const context = canvas.getContext('2d');
  context.filter = blur ? `blur(${blur}px)` : 'none';
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return canvas.toDataURL('image/jpeg', 0.85).split(',')[1];
}, [readFileSync(photo).toString('base64'), blurPx]), 'base64');

// Without TLS: the file input, at full resolution.
const plain = await openBrowser({ ...phone, theme: 'light' });
const { page } = plain;
const picture = async (name, from = page) => process.env.PAGE_PICTURES && from.screenshot({ path: join(process.env.PAGE_PICTURES, `${name}.png`) });
let bytes = 0;
const session = await page.context().newCDPSession(page);
await session.send('Network.enable');
session.on('Network.loadingFinished', (e) => { bytes += e.encodedDataLength; });
const began = Date.now();
await page.goto(links.plain);
await page.locator('#take').waitFor({ state: 'attached' });
await plain.until('the phone is let in', (s) => s.photos.length === 0);
const firstLoad = { bytes, ms: Date.now() - began };
assert.equal(new URL(page.url()).hash, '', 'the pass stays in the address bar');
assert.equal(await page.evaluate(() => isSecureContext), false, 'the page is not tried without TLS');
assert.equal(await page.evaluate(() => document.cookie), '', 'a script can read the pass');
assert.equal(await page.locator('#open_camera').isVisible(), false, 'there is no camera without TLS');
await plain.until('it is told before the first photo that the server answers', (s) => s.connection.ok);
await page.locator('#note', { hasText: /^Connected\.$/ }).waitFor();
await page.locator('#keep_open').waitFor(); // without TLS no browser keeps the page
await page.locator('#secure a[href^="https:"]').first().waitFor();
await picture('phone_first');

await page.locator('#take').setInputFiles(photos[0]);
await plain.until('one photo is received', (s) => s.counts.taken === 1 && s.counts.received === 1);
await page.locator('#choose').setInputFiles(photos.slice(1, 4));
await plain.until('four photos are placed', (s) => s.counts.placed === 4);
told('placed');

// What is no photo is told with what to do; its name is text.
await page.locator('#choose').setInputFiles({ name: '<img src=x onerror=alert(1)>.jpg', mimeType: 'image/jpeg', buffer: Buffer.from('no photo') });
await plain.until('what is no photo is refused', (s) => s.photos.some((p) => p.state === 'refused'));
await page.locator('.photo.refused small').filter({ hasText: 'Send it again as JPEG, PNG or TIFF' }).waitFor();
await page.locator('.photo.refused .name').filter({ hasText: '<img src=x onerror=alert(1)>.jpg' }).waitFor();
await picture('phone_refused');
assert.equal(await page.locator('img[src="x"]').count(), 0);

// Offline and back.
await page.context().setOffline(true);
await page.locator('#choose').setInputFiles(photos[4]);
await plain.until('a photo waits on the phone', (s) => s.counts.taken === 6 && !s.connection.ok);
await page.locator('#note').filter({ hasText: /wait/ }).waitFor();
await page.context().setOffline(false);
await plain.until('it was sent once the network was back', (s) => s.counts.received === 6);

// A reload in the middle of an upload.
await session.send('Network.emulateNetworkConditions', { offline: false, latency: 20, downloadThroughput: -1, uploadThroughput: 20000 });
await page.locator('#choose').setInputFiles(photos[5]);
await plain.until('it is being sent', (s) => s.photos.some((p) => p.state === 'sending'));
await new Promise((r) => setTimeout(r, 1000));
await session.send('Network.emulateNetworkConditions', { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: -1 });
await page.reload();
await plain.until('the photos are there after a reload', (s) => s.counts.taken === 7);
await plain.until('the rest was sent', (s) => s.counts.received === 7);

// A dead server.
told('kill');
await heard('dead');
await page.locator('#choose').setInputFiles(photos[6]);
await plain.until('a photo waits for the server', (s) => s.counts.taken === 8 && !s.connection.ok);
told('revive');
await plain.until('it was sent to the new server', (s) => s.counts.received === 8, 180);
await page.locator('#choose').setInputFiles(photos[7]);
await plain.until('all photos are placed', (s) => s.counts.placed === 8, 180);
await page.evaluate(() => scrollTo(0, 0));
await picture('phone');
await page.locator('#choose').setInputFiles(photos[7]);
await plain.until('the same photo is told', (s) => /is here already/.test(s.problem));
assert.equal((await plain.state()).counts.taken, 9);

assert.deepEqual(await contrastFaults(page), {});
assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'the page is wider than a phone');
await page.setViewportSize({ width: 360, height: 740 });
assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'the page is wider than 360 px');
await page.setViewportSize(phone);
expectClean(plain, links.plain);
await plain.close();

// Over TLS: the camera view, the position, and the page without a network.
const secure = await openBrowser({
  ...phone,
  more: fakeCamera(film),
});
const taken = secure.page;
await taken.context().grantPermissions(['geolocation', 'camera'], { origin: new URL(links.secure).origin });
await taken.context().setGeolocation({ latitude: 47.5, longitude: 8.25, accuracy: 4 });
await taken.goto(links.secure);
await secure.until('the phone is let in', (s) => s.photos.length === 0);
await taken.locator('#position').check();
await taken.waitForFunction(() => window.skein.page.place.position !== null);
await taken.locator('#open_camera').click();
await secure.until('the camera is open', (s) => s.camera);
await taken.waitForFunction(() => document.getElementById('video').videoWidth > 0);
await taken.locator('#shutter').click();
let s = await secure.until('a photo of the camera is received', (now) => now.counts.received === 1);
assert.deepEqual(s.photos[0].gps.slice(0, 2), [47.5, 8.25]);
await taken.locator('#series').click();
await taken.locator('#shutter').click();
s = await secure.until('a series takes photos by itself', (now) => now.counts.taken >= 3);
await taken.locator('#shutter').click();
await picture('phone_camera', taken);
await taken.locator('#close_camera').click();
await secure.until('all of them are received', (now) => now.counts.received === now.counts.taken && now.adding === 0);
told(`camera-${s.photos[0].sha}`);
await secure.until('the browser keeps the page', (now) => now.opensOffline);
assert.equal(await taken.locator('#keep_open').isVisible(), false);
await taken.reload(); // the worker has the page from here on
await secure.until('the page is back', (now) => now.photos.length >= 3);
await taken.context().setOffline(true);
await taken.reload();
s = await secure.until('the page opens without a network', (now) => now.photos.length >= 3);
await taken.context().setOffline(false);
expectClean(secure, links.secure);
await secure.close();

// A camera that is held still for 4 s, then shaken for 2 s, at 30 pictures a second. The screen stays on meanwhile.
const drawing = await openBrowser();
await drawing.page.goto('about:blank');
const still = await redrawn(drawing.page, photos[0], 0);
const shaken = await redrawn(drawing.page, photos[0], 4);
await drawing.close();
const blurredFilm = join(steps, 'blurred.mjpeg');
writeFileSync(blurredFilm, Buffer.concat([...Array(120).fill(still), ...Array(60).fill(shaken)]));
const shaky = await openBrowser({ ...phone, more: fakeCamera(blurredFilm) });
await shaky.page.addInitScript(() => {
  window.locks = [];
  const request = navigator.wakeLock.request.bind(navigator.wakeLock);
  navigator.wakeLock.request = async (type) => {
    window.locks.push(await request(type));
    return window.locks.at(-1);
  };
});
await shaky.page.goto(links.shaky);
await shaky.until('the phone is let in', (now) => now.photos.length === 0);
const heldLocks = () => shaky.page.evaluate(() => window.locks.map((lock) => !lock.released));
assert.deepEqual(await heldLocks(), [], 'the screen stays on although nothing is done');
await shaky.page.locator('#open_camera').click();
await shaky.until('the screen stays on', (now) => now.camera && now.awake);
assert.deepEqual(await heldLocks(), [true]);
await shaky.page.locator('#camera_note').filter({ hasText: 'Blurred: hold still' }).waitFor();
await picture('phone_blurred', shaky.page);
await shaky.page.locator('#camera_note').filter({ hasText: /^$/ }).waitFor();
// Headless Chromium hides no page: the test says that it is hidden, and takes the lock as the browser does.
const setHidden = (hidden) => shaky.page.evaluate((is) => {
  Object.defineProperty(document, 'hidden', { configurable: true, get: () => is });
  if (is) window.locks.at(-1).release();
  document.dispatchEvent(new Event('visibilitychange'));
}, hidden);
await setHidden(true);
await shaky.until('the lock is gone', (now) => !now.awake);
await setHidden(false);
await shaky.until('the screen stays on again', (now) => now.awake);
assert.deepEqual(await heldLocks(), [false, true]);
await shaky.page.locator('#close_camera').click();
await shaky.until('the screen may go off', (now) => !now.camera && !now.awake);
assert.deepEqual(await heldLocks(), [false, false]);
// While photos are sent it stays on, too; then it may go off.
await shaky.page.locator('#choose').setInputFiles(photos[1]);
await shaky.until('it is received', (now) => now.counts.received === 1 && !now.awake);
assert.deepEqual(await heldLocks(), [false, false, false]);
// As an iPhone stores it, whatever its name.
const heic = Buffer.concat([Buffer.from([0, 0, 0, 24]), Buffer.from('ftypheic\0\0\0\0mif1heic'), Buffer.alloc(5000, 1)]);
await shaky.page.locator('#choose').setInputFiles({ name: 'IMG_0001.jpg', mimeType: 'image/jpeg', buffer: heic });
await shaky.page.locator('.photo.refused .what').filter({ hasText: 'Its format is HEIC' }).waitFor();
await shaky.page.locator('.photo.refused small').filter({ hasText: 'Formats > Most Compatible' }).waitFor();
await picture('phone_heic', shaky.page);
expectClean(shaky, links.secure);
await shaky.close();

// Somebody who looks.
const viewer = await openBrowser({ more: ['--ignore-certificate-errors'] });
await viewer.page.goto(links.viewer);
s = await viewer.until("the phone's photos are cameras in the view", (now) => now.connected && now.cameras.length >= 8);
await viewer.page.goto(links.expired);
await viewer.page.locator('#empty').filter({ hasText: 'has expired' }).waitFor();
expectClean(viewer, links.viewer);
await viewer.close();
console.log(`8 photos by the file input, ${photos.length} asked; first load ${firstLoad.bytes} bytes, ${firstLoad.ms} ms until the phone is let in; ${s.cameras.length} cameras in the view`);
