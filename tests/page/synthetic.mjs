// The page against its own test server: a session in which everything occurs, and a server that drops, refuses and
// swallows. node synthetic.mjs SERVER.mjs PAGE_DIR [WORDS]: the cases with these words in their names
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { contrastFaults, expectClean, openBrowser, startChromium } from './browser.mjs';

const [serverPath, pageDir, only = ''] = process.argv.slice(2);

async function startServer(...more) {
  // As many points as the cases need: software draws them.
  const server = spawn(process.execPath, [serverPath, '--port', '0', '--page', pageDir, '--points', '12000', ...more], { stdio: ['pipe', 'pipe', 'inherit'] });
  const lines = createInterface({ input: server.stdout })[Symbol.asyncIterator]();
  const next = async () => (await lines.next()).value ?? assert.fail('the test server ended');
  const url = /^ready (\S+)/.exec(await next())[1];
  // Resolves when the server has obeyed: what is asked of it after that finds it so.
  const tell = async (word) => {
    server.stdin.write(`${word}\n`);
    assert.equal(await next(), `obeyed ${word}`);
  };
  return { url, tell, stop: () => server.kill() };
}

// To an earlier time.
const goBack = (page) => page.locator('#timeline input').evaluate((slider) => {
  slider.value = 300;
  slider.dispatchEvent(new Event('input'));
});

async function measureBetween(page, box, points) {
  await page.locator('#tool_measure').click();
  for (const { x, y } of points) await page.mouse.click(box.x + x, box.y + y);
  await page.locator('.measure_label').waitFor();
  await page.keyboard.press('Escape');
}

// Two places on the canvas where points of the map are, far apart: the first from the left, and from the right. Each
// look is a picture of its own, so none is made in vain.
const twoPoints = (page, { left, right, top, bottom, step } = { left: 150, right: 850, top: 250, bottom: 600, step: 37 }) => page.evaluate((area) => {
  const places = [];
  for (let x = area.left; x < area.right; x += area.step) for (let y = area.top; y < area.bottom; y += area.step) places.push({ x, y });
  const isPoint = ({ x, y }) => window.skein.pickAt(x, y)?.chunk;
  return [places.find(isPoint), places.findLast(isPoint)];
}, { left, right, top, bottom, step });

// Points under a grid of places on the canvas.
const hitsIn = (page, area) => page.evaluate(({ left, right, top, bottom, step }) => {
  const hits = [];
  for (let x = left; x < right; x += step) for (let y = top; y < bottom; y += step) hits.push(window.skein.pickAt(x, y));
  return hits.filter((hit) => hit?.chunk);
}, area);

// Of a grid of places on the canvas where the ground is seen the outermost ones: corners of a polygon in their order.
const groundCorners = (page, { left, right, top, bottom, step }) => page.evaluate((area) => {
  const places = [];
  for (let x = area.left; x < area.right; x += area.step) for (let y = area.top; y < area.bottom; y += area.step) places.push({ x, y });
  const isGround = (hit) => hit?.chunk && hit.point[1] < 0.5;
  const ground = places.filter(({ x, y }) => isGround(window.skein.pickAt(x, y)));
  const outermost = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([u, v]) => ground.reduce((a, b) => (u * a.x + v * a.y < u * b.x + v * b.y ? b : a)));
  return outermost.filter((p, i) => outermost.indexOf(p) === i);
}, { left, right, top, bottom, step });

// Of places in the scene.
const minus = (a, b) => a.map((v, k) => v - b[k]);
const dot = (a, b) => a.reduce((sum, v, k) => sum + v * b[k], 0);
const far = (v) => Math.sqrt(dot(v, v));
const view = async (browser) => {
  await browser.rest();
  return (await browser.state()).view;
};
const picture = async (page, name) => process.env.PAGE_PICTURES && page.screenshot({ path: join(process.env.PAGE_PICTURES, `${name}.png`) });
const isShown = (s) => s.synced && s.points > 5000 && s.loading === 0 && s.cameras.length === 45;

// A camera that sees another, equally sharp scene each second: a film of a JPEG a frame.
async function filmOf(scenes, page) {
  const jpegs = await page.evaluate((n) => Array.from({ length: n }, (_, scene) => {
    const canvas = Object.assign(document.createElement('canvas'), { width: 640, height: 480 });
    const context = canvas.getContext('2d');
    for (let i = 0, x = 1 + scene; i < 1200; i++) {
      x = (x * 48271) % 2147483647;
      context.fillStyle = `hsl(${x % 360} 60% ${20 + (x % 61)}%)`;
      context.fillRect((x >> 4) % 640, (x >> 13) % 480, 40, 40);
    }
    return canvas.toDataURL('image/jpeg', 0.8).split(',')[1];
  }), scenes);
  const folder = mkdtempSync(join(tmpdir(), 'skein_film.'));
  const film = join(folder, 'film.mjpeg');
  writeFileSync(film, Buffer.concat(jpegs.flatMap((jpeg) => Array(30).fill(Buffer.from(jpeg, 'base64')))));
  return { film, remove: () => rmSync(folder, { recursive: true }) };
}

const kPhone = { width: 360, height: 740, theme: 'light' };
const kCamera = { width: 390, height: 844, more: ['--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream'] };

// Fingers on the page: each call says where they are now. Chromium makes pointer events of them, as of a real screen's.
async function fingersOn(page) {
  const session = await page.context().newCDPSession(page);
  const tell = (type, places) => session.send('Input.dispatchTouchEvent', { type, touchPoints: places.map(([x, y], id) => ({ x, y, id })) });
  return {
    put: (places) => tell('touchStart', places),
    move: async (from, to, steps = 8) => {
      for (let i = 1; i <= steps; i++) await tell('touchMove', from.map(([x, y], k) => [x + ((to[k][0] - x) * i) / steps, y + ((to[k][1] - y) * i) / steps]));
    },
    lift: () => tell('touchEnd', []),
  };
}

const cases = {
  async 'all of a finished session is shown'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    const state = await browser.until('the map is there', (s) => s.synced && s.points > 5000 && s.loading === 0 && s.cameras.length === 45);
    assert.deepEqual(state.counts, { received: 49, described: 47, matched: 47, placed: 45, waiting: 0, unplaced: 2, failed: 2 });
    await page.locator('#counts dd').filter({ hasText: /^45$/ }).waitFor();
    const shown = await page.locator('#counts dd').allInnerTexts();
    assert.deepEqual(shown.map(Number).sort((a, b) => a - b), [0, 4, 45, 49]);
    const pixels = await page.evaluate(() => window.skein.pixels());
    assert.ok(pixels.painted > 0.03 && pixels.colours > 200, JSON.stringify(pixels));
    // Nothing changes, so nothing is drawn.
    await browser.rest();
    const before = (await browser.state()).framesDrawn;
    await page.waitForTimeout(1500);
    assert.ok((await browser.state()).framesDrawn - before <= 3, 'it draws although nothing changes');
  },

  async 'before the first photo it is said what is waited for'({ browser, start }) {
    const server = await start('--hold=-1', '--speed', '20');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it is connected', (s) => s.synced);
    await page.locator('#empty').filter({ hasText: /^No photos yet\s*The map appears here as photos arrive\.\s*(Press Invite.*\.)?$/ }).waitFor();
    await server.tell('go');
    await browser.until('photos are placed', (s) => s.cameras.length >= 2);
    await page.locator('#empty').waitFor({ state: 'hidden' });
    return server.url;
  },

  async 'what stands in the way is told until it is mended'({ browser, start }) {
    const server = await start('--hold=-1');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it is connected', (s) => s.synced);
    assert.equal(await page.locator('#troubles').isVisible(), false);
    await server.tell('full');
    await page.locator('#troubles').filter({ hasText: 'the disk is almost full' }).waitFor();
    await picture(page, 'troubles');
    assert.deepEqual(await contrastFaults(page), {});
    await server.tell('obey');
    await page.locator('#troubles').waitFor({ state: 'hidden' });
    return server.url;
  },

  async 'an operator finishes from the page'({ browser, start }) {
    const server = await start('--speed', '12', '--hold', '12');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it grows', (s) => s.counts.placed > 2);
    const part = page.locator('.finish_part');
    await part.locator('input').fill('soon');
    await part.locator('button').click();
    await part.filter({ hasText: 'Give minutes, at most 1440, or nothing.' }).waitFor();
    await server.tell('unasked');
    await part.locator('input').fill('0.5');
    await part.locator('button').click();
    await part.filter({ hasText: 'It does not begin: ingest does not answer' }).waitFor();
    await server.tell('obey');
    const asked = page.waitForRequest((r) => r.url().endsWith('/api/finish'));
    await part.locator('button').click();
    assert.deepEqual((await asked).postDataJSON(), { within_s: 30 });
    await picture(page, 'finish');
    assert.deepEqual(await contrastFaults(page), {});
    await server.tell('go');
    await part.filter({ hasText: 'Finished.' }).waitFor();
    return server.url;
  },

  async 'an operator shortens a finish that runs'({ browser, start }) {
    const server = await start('--speed', '12', '--hold', '38');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it finishes', (s) => s.finish?.state === 'requested');
    const part = page.locator('.finish_part');
    await part.filter({ hasText: /The last photos are being matched\. Its time is up in \d/ }).waitFor();
    await part.locator('.finish_detail').filter({ hasText: /^Waits for 2 photos\.$/ }).waitFor();
    const button = part.locator('button');
    assert.deepEqual([await button.textContent(), await button.isDisabled()], ['Shorten', true], 'there is no shorter time than none');
    await part.locator('input').fill('1');
    await server.tell('unasked');
    await button.click();
    await part.filter({ hasText: 'It is not shortened: ingest does not answer' }).waitFor();
    await server.tell('obey');
    const asked = page.waitForRequest((r) => r.url().endsWith('/api/finish'));
    await button.click();
    assert.deepEqual((await asked).postDataJSON(), { within_s: 60 });
    await picture(page, 'finish_shortened');
    assert.deepEqual(await contrastFaults(page), {});
    await server.tell('go');
    await part.filter({ hasText: 'Finished.' }).waitFor();
    assert.deepEqual([await button.textContent(), await part.locator('input').inputValue()], ['Finish', '']);
    return server.url;
  },

  async 'what to photograph next is told and shown'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    const state = await browser.until('the stations are there', (s) => s.points > 5000 && s.loading === 0 && s.stations.length > 0);
    const agents = new Set(state.stations.map((s) => s.agent));
    assert.equal(state.stations.length, 2 * agents.size);
    assert.ok(agents.size >= 2, 'of one agent only');
    assert.ok(state.stations.every((s) => state.cameras.includes(s.from)), 'a way that begins nowhere');
    await page.locator('.places .place', { hasText: '82 % good' }).first().waitFor();
    await page.locator('.places .light.nearly').waitFor();
    await page.locator('.advice .place', { hasText: '0.5 m to the right' }).first().waitFor();
    // Stations are no photos: they are not picked.
    assert.ok(state.cameras.length === 45);
    await page.locator('#tool_layers').click();
    await page.locator('#settings label', { hasText: 'Photos to take' }).locator('input').uncheck();
    await browser.until('the stations are gone', (s) => s.stations.length === 0);
  },

  async 'cameras and points are picked where they are seen'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    const { cameras } = await browser.until('the map is there', (s) => s.points > 5000 && s.loading === 0 && s.cameras.length === 45);
    await browser.rest();
    const hits = await page.evaluate((images) => images.filter((image) => {
      const at = window.skein.project(image);
      return at && window.skein.pickAt(at.x, at.y)?.image === image;
    }), cameras);
    assert.ok(hits.length > 0.5 * cameras.length, `only ${hits.length} of ${cameras.length} cameras are found where they are seen`);
    const box = await page.locator('#canvas').boundingBox();
    const at = await page.evaluate((image) => window.skein.project(image), hits[0]);
    await page.mouse.click(box.x + at.x, box.y + at.y);
    await browser.until('the clicked camera is selected', (s) => s.selection?.image === hits[0]);
    await page.locator('.inspect', { hasText: 'Placed in map 1' }).waitFor();
    // Compare with its best match.
    await page.locator('.matches li button').first().click();
    await page.locator('.match_line').nth(10).waitFor({ state: 'attached' });
    await page.keyboard.press('Escape');
    const point = await page.evaluate(() => {
      for (let y = 200; y < 600; y += 5) {
        for (let x = 200; x < 800; x += 5) {
          const hit = window.skein.pickAt(x, y);
          if (hit?.chunk) return { x, y, hit };
        }
      }
      return null;
    });
    await page.mouse.click(box.x + point.x, box.y + point.y);
    await browser.until('the photos that see the point are told', (s) => s.selection?.seen?.photos?.length >= 2);
    await page.locator('.sightings li').nth(1).waitFor();
  },

  async 'the surface is shown in place of points, and asked for only then'({ browser, start }) {
    const server = await start('--at', 'end', '--depth', '100');
    const { page } = browser;
    const asked = [];
    page.on('request', (r) => /\/dense/.test(r.url()) && asked.push(r.url()));
    await page.goto(server.url);
    const before = await browser.until('the map is there', (s) => isShown(s) && s.surface.of.length === 1);
    const button = page.locator('#tool_surface');
    assert.deepEqual([asked, await button.getAttribute('aria-pressed'), await button.isEnabled()], [[], 'false', true]);
    await button.click();
    const shown = await browser.until('the surface is there', (s) => s.surface.on && s.surface.points > 100000 && s.surface.loading === 0);
    assert.deepEqual([shown.points, shown.pointsShown], [before.points, 0]);
    assert.equal(await button.getAttribute('aria-pressed'), 'true');
    await browser.rest();
    await picture(page, 'surface');
    // A point of it tells its photo, and a distance is measured on it.
    const [a, b] = await twoPoints(page);
    const box = await page.locator('#canvas').boundingBox();
    await page.mouse.click(box.x + a.x, box.y + a.y);
    await browser.until('its photo is told', (s) => s.selection?.photo > 0 && s.selection.seen.photos.length === 1);
    await page.locator('.inspect', { hasText: 'It is from the depth map of this photo' }).waitFor();
    await measureBetween(page, box, [a, b]);
    // As it was: fewer photos, less surface.
    await goBack(page);
    await browser.until('an earlier time has less of it', (s) => !s.isLive && s.surface.pointsShown < 0.8 * shown.surface.pointsShown);
    await page.locator('#timeline .now').click();
    await browser.until('now again', (s) => s.isLive && s.surface.pointsShown === shown.surface.pointsShown);
    // A reload keeps the choice; the key takes it back.
    await page.reload();
    await browser.until('it is shown again', (s) => s.surface.on && s.surface.points === shown.surface.points && s.surface.loading === 0);
    await page.keyboard.press('p');
    await browser.until('the points are back', (s) => !s.surface.on && s.pointsShown === before.pointsShown && s.surface.pointsShown === 0);
    return server.url;
  },

  async 'the mesh is shown after the surface, and asked for only then'({ browser, start }) {
    const server = await start('--at', 'end', '--depth', '60', '--mesh');
    const { page } = browser;
    const asked = [];
    page.on('request', (r) => /\/mesh/.test(r.url()) && asked.push(r.url()));
    await page.goto(server.url);
    const before = await browser.until('the map is there', (s) => isShown(s) && s.surface.of.length === 1 && s.mesh.of.length === 1);
    await page.keyboard.press('p');
    await browser.until('the surface is there', (s) => s.surface.on && s.surface.points > 10000 && s.surface.loading === 0);
    assert.deepEqual(asked, []);
    await page.keyboard.press('p');
    const triangles = 45 * 2 * 32 * 24; // a piece of a plane before each photo
    const shown = await browser.until('the mesh is there', (s) => s.mesh.on && s.mesh.triangles === triangles && s.mesh.loading === 0);
    assert.deepEqual([shown.mesh.trianglesShown, shown.pointsShown, shown.surface.pointsShown, shown.surface.on], [triangles, 0, 0, false]);
    assert.equal(await page.locator('#tool_surface').getAttribute('aria-pressed'), 'true');
    await browser.rest();
    await picture(page, 'mesh');
    // A point of it is told, and a distance is measured on it.
    const [a, b] = await twoPoints(page);
    const box = await page.locator('#canvas').boundingBox();
    await page.mouse.click(box.x + a.x, box.y + a.y);
    await browser.until('the point is told', (s) => s.selection?.isMesh && s.selection.seen.photos.length === 0);
    await page.locator('.inspect', { hasText: 'A point of the surface.' }).waitFor();
    await measureBetween(page, box, [a, b]);
    // An earlier time has points in its place.
    await goBack(page);
    await browser.until('an earlier time has points', (s) => !s.isLive && s.mesh.trianglesShown === 0 && s.pointsShown > 0);
    await page.locator('#timeline .now').click();
    await browser.until('now again', (s) => s.isLive && s.mesh.trianglesShown === triangles);
    // A reload keeps the choice; the key takes it back.
    await page.reload();
    await browser.until('it is shown again', (s) => s.mesh.on && s.mesh.trianglesShown === triangles && s.mesh.loading === 0);
    await page.keyboard.press('p');
    await browser.until('the points are back', (s) => !s.mesh.on && s.pointsShown === before.pointsShown && s.mesh.trianglesShown === 0);
    return server.url;
  },

  async 'confidence as colour: a switch, a legend, and colours as they were'({ browser, start }) {
    const server = await start('--at', 'end', '--depth', '100');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', (s) => isShown(s) && s.surface.of.length === 1);
    const mean = async () => {
      await browser.rest();
      return (await page.evaluate(() => window.skein.pixels())).mean;
    };
    const confidence = page.locator('#settings label', { hasText: 'Confidence' }).locator('input');
    const legend = page.locator('#legend');
    assert.equal(await legend.isVisible(), false);
    const sparse = await mean();
    await page.locator('#tool_layers').click();
    await confidence.check();
    await legend.filter({ hasText: 'Only the surface has it' }).waitFor();
    const isAlike = (a, b) => far(minus(a, b)) < 1; // but for cameras under the pointer and pictures that load
    assert.ok(isAlike(await mean(), sparse), 'sparse points have no confidence');
    await confidence.uncheck();
    await page.keyboard.press('Escape');
    await page.evaluate(() => document.activeElement.blur());
    await page.keyboard.press('p');
    await browser.until('the surface is there', (s) => s.surface.on && s.surface.points > 100000 && s.surface.loading === 0);
    const before = await mean();
    await confidence.check();
    await legend.filter({ hasText: /uncertain, ±1 % of distance\s*sure/ }).waitFor();
    const coloured = await mean();
    assert.ok(coloured[0] - coloured[2] > 10 + before[0] - before[2], `from red to green: ${before} and ${coloured}`);
    for (const theme of ['light', 'dark']) {
      if ((await page.locator('html').getAttribute('data-theme')) !== theme) await page.locator('#theme_button').click();
      assert.deepEqual(await contrastFaults(page), {}, theme);
    }
    await browser.rest();
    await picture(page, 'confidence');
    await confidence.uncheck();
    await legend.waitFor({ state: 'hidden' });
    assert.ok(isAlike(await mean(), before), 'the colours are others than before');
    return server.url;
  },

  async 'confidence on a phone: the switch stays above its legend'({ openPhone, start }) {
    const server = await start('--at', 'end', '--depth', '60');
    const browser = await openPhone();
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', (s) => isShown(s) && s.surface.of.length === 1);
    await page.locator('#tool_surface').tap();
    await page.locator('#tool_layers').tap();
    const confidence = page.locator('#settings label', { hasText: 'Confidence' }).locator('input');
    await confidence.tap();
    const legend = page.locator('#legend');
    await legend.waitFor();
    await confidence.tap(); // nothing lies over it
    await legend.waitFor({ state: 'hidden' });
    await confidence.tap();
    await page.locator('#tool_layers').tap();
    await browser.until('the surface is there', (s) => s.surface.on && s.surface.pointsShown > 1000 && s.surface.loading === 0);
    await browser.rest();
    await picture(page, 'confidence_phone');
    const place = await legend.boundingBox();
    assert.ok(place.x >= 0 && place.x + place.width <= 360, JSON.stringify(place));
    assert.deepEqual(await contrastFaults(page), {});
    expectClean(browser, server.url);
    await browser.close();
  },

  async 'a profile between two points: its chart, what the pointer is on, and its CSV'({ browser, start }) {
    const server = await start('--at', 'end', '--gps', '--depth', '100');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', (s) => isShown(s) && s.surface.of.length === 1);
    await page.keyboard.press('p');
    await browser.until('the surface is there', (s) => s.surface.on && s.surface.points > 100000 && s.surface.loading === 0);
    await browser.rest();
    const box = await page.locator('#canvas').boundingBox();
    const [a, , b] = await groundCorners(page, { left: 150, right: box.width - 60, top: 200, bottom: box.height - 60, step: 53 });
    await page.locator('#tool_measure').click();
    for (const { x, y } of [a, b]) await page.mouse.click(box.x + x, box.y + y);
    const button = page.locator('#measure_profile');
    await button.click();
    const told = page.locator('#profile_told');
    await told.filter({ hasText: /\d points in a strip .* c?m wide; heights over the first point, drawn × / }).waitFor();
    assert.match(await page.locator('.profile_plot').innerHTML(), />Distance, m<.*>Height, m</);
    const plot = await page.locator('.profile_plot').boundingBox();
    await page.mouse.move(plot.x + 0.5 * plot.width, plot.y + 0.5 * plot.height);
    await told.filter({ hasText: /^distance [\d.]+ c?m, (height [+−][\d.]+ (m|cm|mm), \d+ points?|no points)$/ }).waitFor();
    await picture(page, 'profile');
    const [saved] = await Promise.all([page.waitForEvent('download'), page.locator('#profile button', { hasText: 'Save as CSV' }).click()]);
    assert.equal(saved.suggestedFilename(), 'profile.csv');
    const lines = readFileSync(await saved.path(), 'utf8').trimEnd().split('\r\n');
    assert.equal(lines[0], 'distance_m,height_m,lowest_m,highest_m,points');
    const rows = lines.slice(1).map((line) => line.split(',').map(Number));
    assert.equal(rows.length, 100);
    // Across a street of 48 m x 15 m: as far as the two points are apart, as seen from above.
    const metres = parseFloat(await page.locator('.measure_label').innerText());
    assert.ok(Math.abs((rows[99][0] * 100) / 99.5 - metres) < 0.1 * metres, `${rows[99][0]} of ${metres} m`);
    const filled = rows.filter((row) => row[4] > 0);
    assert.ok(filled.length > 30, `${filled.length} cells have points`);
    for (const [, height, low, high] of filled) assert.ok(low <= height && height <= high && low > -3 && high < 15, `${low} ${height} ${high}`);
    for (const theme of ['light', 'dark']) {
      if ((await page.locator('html').getAttribute('data-theme')) !== theme) await page.locator('#theme_button').click();
      assert.deepEqual(await contrastFaults(page), {}, theme);
    }
    // Sparse points are called so; the next measurement closes it.
    await page.evaluate(() => document.activeElement.blur());
    await page.keyboard.press('p');
    await page.mouse.move(box.x + 400, box.y + 20);
    await told.filter({ hasText: /sparse points? in a strip/ }).waitFor();
    await button.click();
    await page.locator('#profile').waitFor({ state: 'hidden' });
    await button.click();
    await page.locator('#profile').waitFor();
    await page.keyboard.press('Escape');
    await page.locator('#profile').waitFor({ state: 'hidden' });
    return server.url;
  },

  async 'a profile on a phone: within the map, and by fingers'({ openPhone, url }) {
    const browser = await openPhone();
    const { page } = browser;
    await page.goto(url);
    await browser.until('the map is there', isShown);
    await page.locator('#tool_measure').tap();
    await browser.rest();
    const stage = await page.locator('#stage').boundingBox();
    const box = await page.locator('#canvas').boundingBox();
    const points = await twoPoints(page, { left: 20, right: box.width - 20, top: 90, bottom: box.height - 20, step: 11 });
    for (const { x, y } of points) await page.touchscreen.tap(box.x + x, box.y + y);
    await page.locator('#measure_profile').tap();
    await page.locator('.profile_plot').waitFor();
    const plot = await page.locator('.profile_plot').boundingBox();
    await page.touchscreen.tap(plot.x + plot.width / 2, plot.y + plot.height / 2);
    await picture(page, 'profile_phone');
    const chart = await page.locator('#profile').boundingBox();
    assert.deepEqual(await page.locator('#stage').boundingBox(), stage, 'the map moves');
    assert.ok(chart.x >= 0 && chart.x + chart.width <= 360 && chart.y >= stage.y && chart.y + chart.height <= stage.y + stage.height, JSON.stringify(chart));
    assert.ok(chart.height < 0.5 * stage.height, `of the map ${stage.height - chart.height} px are left`);
    for (const part of await page.locator('#profile button, #measure_profile').all()) assert.ok((await part.boundingBox()).height >= 40, 'too small for fingers');
    assert.match(await page.locator('.profile_plot').innerHTML(), />Distance, units</);
    assert.deepEqual(await contrastFaults(page), {});
    await page.getByLabel('Close the profile').tap();
    await page.locator('#profile').waitFor({ state: 'hidden' });
    expectClean(browser, url);
    await browser.close();
  },

  async 'a section hides points outside its box from eyes, clicks and measurements'({ browser, start }) {
    const server = await start('--at', 'end', '--gps', '--depth', '100');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', (s) => isShown(s) && s.surface.of.length === 1);
    await page.keyboard.press('p');
    await browser.until('the surface is there', (s) => s.surface.on && s.surface.points > 100000 && s.surface.loading === 0);
    await browser.rest();
    const area = { left: 150, right: 640, top: 200, bottom: 600, step: 55 };
    const all = await hitsIn(page, area);
    await page.locator('#tool_layers').click();
    await page.locator('#settings label', { hasText: 'Section' }).locator('input').check();
    const panel = page.locator('#section');
    await panel.filter({ hasText: /East.* to .* m\s*North.* m\s*Up.* m/s }).waitFor();
    assert.equal(await panel.locator('button', { hasText: 'Reset' }).isEnabled(), false);
    assert.equal((await browser.state()).section, null, 'a section without bounds hides nothing');
    // Up to a third of the height, by the mouse; from the middle eastwards, by keys.
    const up = await panel.getByLabel('Up, to').boundingBox();
    await page.mouse.click(up.x + up.width / 3, up.y + up.height / 2);
    const east = panel.getByLabel('East, from');
    await east.focus();
    for (let i = 0; i < 5; ++i) await page.keyboard.press('PageUp');
    const { section } = await browser.until('both bounds are set', (s) => s.section?.high[1] < 1e3 && s.section.low[0] > -1e3);
    await browser.rest();
    await picture(page, 'section');
    const inside = await hitsIn(page, area);
    assert.ok(inside.length > 3 && inside.length < all.length, `${inside.length} of ${all.length}`);
    for (const { point } of inside) assert.ok(point[1] <= section.high[1] + 1e-6 && point[0] >= section.low[0] - 1e-6, JSON.stringify(point));
    assert.ok(all.some(({ point }) => point[1] > section.high[1]) && all.some(({ point }) => point[0] < section.low[0]));
    for (const theme of ['light', 'dark']) {
      if ((await page.locator('html').getAttribute('data-theme')) !== theme) await page.locator('#theme_button').click();
      assert.deepEqual(await contrastFaults(page), {}, theme);
    }
    // The volume is of the points that are seen.
    const box = await page.locator('#canvas').boundingBox();
    const corners = await groundCorners(page, { left: 350, right: 630, top: 300, bottom: box.height - 60, step: 35 });
    assert.ok(corners.length >= 3, JSON.stringify(corners));
    await page.locator('#tool_measure').click();
    await page.locator('#measure_area').click();
    for (const { x, y } of corners) await page.mouse.click(box.x + x, box.y + y);
    await page.locator('#measure_close').click();
    const pointsOf = async () => Number(/([\d\u202f]+) points?,? /.exec(await page.locator('.measure_label').innerText())[1].replaceAll('\u202f', ''));
    await page.locator('.measure_label').filter({ hasText: /points/ }).waitFor();
    const few = await pointsOf();
    await panel.locator('button', { hasText: 'Reset' }).click();
    await browser.until('all is shown', (s) => s.section === null);
    await page.waitForFunction((n) => Number(/([\d\u202f]+) points?,? /.exec(document.querySelector('.measure_label').innerText)[1].replaceAll('\u202f', '')) > n, few);
    await page.keyboard.press('Escape');
    // Its end is the switch's, too.
    await panel.getByLabel('End the section').click();
    await panel.waitFor({ state: 'hidden' });
    await page.locator('#tool_layers').click();
    assert.equal(await page.locator('#settings label', { hasText: 'Section' }).locator('input').isChecked(), false);
    return server.url;
  },

  async 'a section on a phone: by fingers, and nothing is cut off'({ openPhone, url }) {
    const browser = await openPhone();
    const { page } = browser;
    await page.goto(url);
    await browser.until('the map is there', isShown);
    await page.locator('#tool_layers').tap();
    await page.locator('#settings label', { hasText: 'Section' }).locator('input').tap();
    const slider = page.locator('#section').getByLabel('Up, to');
    const at = await slider.boundingBox();
    await page.touchscreen.tap(at.x + at.width / 2, at.y + at.height / 2);
    await browser.until('it is cut', (s) => s.section?.high[1] < 1e3);
    await browser.rest();
    await picture(page, 'section_phone');
    const stage = await page.locator('#stage').boundingBox();
    const panel = await page.locator('#section').boundingBox();
    assert.ok(panel.x >= 0 && panel.x + panel.width <= 360 && panel.y + panel.height <= stage.y + stage.height, JSON.stringify(panel));
    assert.ok(panel.height < 0.5 * stage.height, `of the map ${stage.height - panel.height} px are left`);
    for (const part of await page.locator('#section button, #section input').all()) assert.ok((await part.boundingBox()).height >= 40, 'too small for fingers');
    assert.deepEqual(await contrastFaults(page), {});
    await page.locator('#section button', { hasText: 'Reset' }).tap();
    await browser.until('all is shown', (s) => s.section === null);
    expectClean(browser, url);
    await browser.close();
  },

  async 'without a surface its switch says so'({ browser, start }) {
    const server = await start('--at', 'end', '--depth', '0');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', isShown);
    assert.equal(await page.locator('#tool_surface').isEnabled(), false);
    assert.match(await page.locator('#tool_surface').getAttribute('title'), /^No surface yet: /);
    await page.keyboard.press('p');
    assert.equal((await browser.state()).surface.on, false);
    return server.url;
  },

  async 'what is not placed says why; names are text'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    await browser.until('everything is known', (s) => s.synced && s.counts.received === 49);
    await page.locator('#tab_unplaced').click();
    await page.locator('.unplaced_list li').nth(3).waitFor();
    const text = await page.locator('.unplaced_list').first().innerText();
    assert.match(text, /No other photo shows the same place yet/);
    assert.match(text, /too little in common with what is mapped/);
    assert.match(text, /no photo that can be read/);
    assert.match(text, /notes\.txt/);
    await page.evaluate(() => window.skein.select(12));
    await page.locator('.inspect h2').filter({ hasText: '<img src=x onerror=alert(1)>.jpg' }).waitFor();
    assert.equal(await page.locator('img[src="x"]').count(), 0);
  },

  async 'a photo that is dismissed counts no more, and is brought back'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    await browser.until('everything is known', (s) => s.synced && s.counts.received === 49);
    await page.locator('#tab_unplaced').click();
    // Each has a picture but what was refused, of which nothing was kept.
    await page.locator('.unplaced_list li').nth(3).waitFor();
    assert.deepEqual([await page.locator('.unplaced_list img').count(), await page.locator('.unplaced_list .no_picture').count()], [3, 1]);
    const tells = async (on, badge, sentence) => {
      await on.locator('#tab_unplaced .badge').filter({ hasText: new RegExp(`^${badge}$`) }).waitFor({ state: 'attached' });
      await on.locator('.count.unplaced dd').filter({ hasText: new RegExp(`^${badge || 0}$`) }).waitFor();
      await on.locator('#sentence').filter({ hasText: sentence }).waitFor();
    };
    await tells(page, '4', 'One map. 4 photos not placed.');
    await page.locator('.unplaced_list li', { hasText: 'notes.txt' }).getByRole('button', { name: /^Dismiss/ }).click();
    await tells(page, '3', 'One map. 3 photos not placed, and 1 dismissed.');
    await page.locator('.count.unplaced .aside', { hasText: '1 dismissed' }).waitFor();
    await page.locator('.dismissed_part summary').filter({ hasText: 'Dismissed: 1 photo' }).click();
    await page.locator('.dismissed_part li', { hasText: 'notes.txt' }).waitFor();
    await picture(page, 'dismissed');
    assert.deepEqual(await contrastFaults(page), {});
    // Another page of this browser has it at once, and a reload keeps it.
    const other = await page.context().newPage();
    await other.goto(url);
    await tells(other, '3', 'and 1 dismissed');
    await page.reload();
    await tells(page, '3', 'and 1 dismissed');
    await page.locator('#tab_unplaced').click();
    for (let left = 3; left > 0; left--) {
      await page.locator('.unplaced_list li:visible').first().getByRole('button', { name: /^Dismiss/ }).click();
      await browser.until('one less is left', (s) => s.dismissed === 5 - left);
    }
    await tells(page, '', '4 photos not placed, and dismissed.');
    await page.locator('#panel_unplaced').filter({ hasText: 'All of them are dismissed.' }).waitFor();
    await page.locator('.dismissed_part summary').click();
    await page.locator('.dismissed_part li', { hasText: 'notes.txt' }).getByRole('button', { name: /^Bring back/ }).click();
    await tells(page, '1', '1 photo not placed, and 3 dismissed.');
    await tells(other, '1', 'and 3 dismissed');
    await other.close();
  },

  async 'an operator has what is not placed tried again, where that may help'({ browser, start }) {
    const server = await start('--speed', '10', '--hold', '25');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('a photo is not placed', (s) => s.unplaced.includes(17));
    await page.locator('#tab_unplaced').click();
    const part = page.locator('.retry_part');
    await part.filter({ hasText: 'is tried again by itself when one that shows the same place is placed' }).waitFor();
    await picture(page, 'retry');
    await server.tell('unasked');
    await part.locator('button').click();
    await part.filter({ hasText: 'They are not tried: ingest does not answer' }).waitFor();
    await server.tell('obey');
    const asked = page.waitForRequest((r) => r.url().endsWith('/api/finish'));
    await part.locator('button').click();
    assert.deepEqual((await asked).postDataJSON(), { within_s: 0 });
    await part.filter({ hasText: 'Asked: they are tried again.' }).waitFor();
    await server.tell('go');
    await part.filter({ hasText: 'another try would find the same' }).waitFor();
    assert.equal(await part.locator('button').isVisible(), false);
    return server.url;
  },

  async 'before the first photo there are no figures of none'({ browser, start }) {
    const server = await start('--hold=-1', '--speed', '20');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it is connected', (s) => s.synced);
    await page.locator('.processes_part', { hasText: 'Processes: 7' }).waitFor();
    const text = await page.locator('#panel_overview').innerText();
    assert.doesNotMatch(text, /From received|Waiting|Finish|\d s\b/);
    await server.tell('go');
    await page.locator('#panel_overview', { hasText: 'half within' }).waitFor();
    await browser.until('all is there', (s) => s.finish?.state === 'done' && s.cameras.length === 45);
    // Numbers agree: what the agents sent, refused ones among them, is what was received.
    const rows = await page.locator('.agents .value').allInnerTexts();
    const [placed, received] = [/^\d+/, /(?<=of )\d+/].map((number) => rows.reduce((sum, row) => sum + Number(number.exec(row)[0]), 0));
    assert.deepEqual([placed, received], [45, 49]);
    return server.url;
  },

  async 'an invitation asks whose it is'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    await page.locator('#invite_button').click();
    const dialog = page.locator('dialog[open]');
    const invite = async (name, label) => {
      await dialog.getByLabel('Whose phone').fill(name);
      const asked = page.waitForRequest((r) => r.url().endsWith('/api/invitations'));
      await dialog.locator('button', { hasText: label }).click();
      return (await asked).postDataJSON();
    };
    assert.deepEqual(await invite('J\u00fcrgen M.', 'A phone that takes photos'), { role: 'agent', name: 'Jurgen-M' });
    await dialog.locator('.invitation', { hasText: 'For Jurgen-M.' }).waitFor();
    assert.doesNotMatch(await dialog.innerText(), /null|false/);
    await picture(page, 'invited');
    await invite('anna', 'A phone that takes photos');
    await dialog.locator('.invitation', { hasText: 'Photos of anna are here already' }).waitFor();
    assert.deepEqual(await invite('', 'Somebody who looks'), { role: 'viewer', name: '' });
    await dialog.getByLabel('Whose phone').fill('\u5f20\u4f1f');
    await dialog.locator('button', { hasText: 'Somebody who looks' }).click();
    await dialog.locator('.invitation', { hasText: 'letters from a to z' }).waitFor();
  },

  async 'where GPS tells: north, and where a point is on earth'({ browser, start, url }) {
    const server = await start('--at', 'end', '--gps');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', isShown);
    await browser.rest();
    const turn = () => page.locator('#needle').evaluate((needle) => Number(/rotate\(([-\d.e]+)rad/.exec(needle.style.transform)[1]));
    assert.ok(Math.abs((await turn()) - (await browser.state()).view.yaw) < 1e-3 && Math.abs(await turn()) > 0.05);
    // The street runs east: seen from the south anna's first photo, its western end, is at the left.
    await page.locator('#north').click();
    const north = await view(browser);
    assert.ok(Math.abs(north.yaw) < 1e-3 && Math.abs(await turn()) < 1e-3 && Math.abs(north.forward[0]) < 1e-3);
    const [west, east] = await page.evaluate(() => [1, 2].map((image) => window.skein.project(image)));
    assert.ok(west.x < east.x, 'west is at the right');
    const box = await page.locator('#canvas').boundingBox();
    const [{ x, y }] = await twoPoints(page);
    await page.mouse.click(box.x + x, box.y + y);
    const where = page.locator('.inspect .facts');
    await where.filter({ hasText: /Metres\s*\d+\.\d+\sm (east|west), .* from anna\/IMG_0001\.jpg/ }).waitFor();
    const [latitude, longitude] = /Degrees\s*([\d.]+), ([\d.]+)/.exec(await where.innerText()).slice(1).map(Number);
    assert.ok(Math.abs(latitude - 52.5) < 3e-4 && Math.abs(longitude - 13.4) < 6e-4, `${latitude}, ${longitude}`);
    await picture(page, 'where');
    await page.locator('#tool_measure').click();
    await page.mouse.click(box.x + x, box.y + y);
    await page.locator('#notice').filter({ hasText: /^52\.\d+, 13\.\d+\. Click the second point\.$/ }).waitFor();
    // Without GPS neither is told.
    const other = await page.context().newPage();
    await other.goto(url);
    await other.waitForFunction(() => window.skein?.state().cameras.length === 45 && window.skein.state().framesDrawn > 0);
    assert.equal(await other.locator('#north').isVisible(), false);
    await other.close();
    browser.hosts.delete(new URL(url).host);
    return server.url;
  },

  async 'the time slider shows the session as it was'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    await browser.until('everything is known', (s) => s.synced && s.cameras.length === 45);
    await goBack(page);
    const past = await browser.until('an earlier time', (s) => !s.isLive && s.cameras.length < 30);
    assert.ok(past.counts.received < 30 && past.submaps.length === 2 && past.shownHead < past.head);
    assert.equal(past.cameras.length, past.counts.placed);
    await page.locator('#timeline .now').click();
    await browser.until('now again', (s) => s.isLive && s.counts.received === 49);
    await page.locator('#timeline select').selectOption('100');
    // In one step: a replay of 100 times the speed is soon over.
    const isLive = await page.locator('#timeline button').first().evaluate((button) => {
      button.click();
      return window.skein.state().isLive;
    });
    assert.ok(!isLive, 'the replay does not run');
    await browser.until('the replay ends with now', (s) => s.isLive && s.counts.received === 49);
  },

  async 'two maps grow, are joined, and what the server swallowed is pulled'({ browser, start }) {
    // Time stands still before the silence, and before the merge ends: a join is seen where both maps are drawn by then.
    const server = await start('--speed', '12', '--hold', '25,32');
    const { page } = browser;
    await page.emulateMedia({ reducedMotion: 'no-preference' });
    await page.goto(server.url);
    const areTwo = (s) => s.submaps.length === 2 && s.cameras.length >= 8 && s.shapes.length === 2;
    await browser.until('two maps grow side by side', areTwo);
    await server.tell('silence');
    await server.tell('go');
    await page.waitForTimeout(1500);
    await server.tell('obey');
    await browser.until('what was swallowed is there', (s) => areTwo(s) && s.loading === 0 && s.merges.some((m) => m.state === 'frozen'));
    await server.tell('go');
    // Of the move its end is waited for: a slow machine may look at the page less often than the move lasts.
    await browser.until('the one map has moved to the other', (s) => s.joined.length === 1);
    const state = await browser.until('one map with all cameras', (s) => s.finish?.state === 'done' && s.joining.length === 0 && s.cameras.length === 45 && s.shapes.length === 1);
    assert.deepEqual(state.merges, [{ source: 2, target: 1, state: 'done' }]);
    assert.equal(state.counts.received, 49);
    await page.locator('#tab_maps').click();
    await page.locator('.merge.done').filter({ hasText: 'Joined map 2 to map 1' }).waitFor();
    return server.url;
  },

  async 'a server that goes and comes back is told, and missed by nothing'({ browser, start }) {
    const server = await start('--speed', '12', '--hold', '12');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it grows', (s) => s.counts.placed > 2);
    await server.tell('refuse');
    await server.tell('drop');
    await server.tell('go'); // nobody hears of what happens now
    await page.locator('#connection.lost').filter({ hasText: /Not connected: last heard .* ago/ }).waitFor();
    await page.waitForTimeout(2500);
    await server.tell('obey');
    await browser.until('it is connected again', (s) => s.connected);
    const state = await browser.until('all is there', (s) => s.finish?.state === 'done' && s.cameras.length === 45);
    assert.equal(state.counts.received, 49);
    return server.url;
  },

  async 'an invitation that ends is told'({ browser, start }) {
    const server = await start('--at', 'end');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it is connected', (s) => s.connected);
    await server.tell('revoke');
    await page.locator('#connection.lost').filter({ hasText: 'Not connected: this invitation was revoked' }).waitFor();
    await page.locator('#notice').filter({ hasText: 'Ask whoever runs the session for a new one' }).waitFor();
    return server.url;
  },

  async 'who is not let in reads why and what to do, on the page and on a phone'({ browser, openPhone, start }) {
    const server = await start('--at', 'end');
    const { page } = browser;
    const phone = await openPhone();
    const door = (on, id, ...texts) => Promise.all(texts.map((text) => on.locator(id).filter({ hasText: text }).waitFor()));
    // The server out of reach: its files are here, and nothing else comes.
    for (const { page: on } of [browser, phone]) {
      await on.route('**/api/**', (route) => route.abort());
      await on.routeWebSocket(/\/ws$/, (socket) => socket.close());
    }
    await page.goto(server.url);
    await phone.page.goto(`${server.url}phone`);
    await door(page, '#empty', 'Server not reached', 'The page tries again by itself');
    await door(phone.page, '#door', 'Server not reached', 'The page tries again by itself');
    for (const { page: on } of [browser, phone]) {
      await on.unrouteAll();
      assert.deepEqual(await contrastFaults(on), {});
    }
    await phone.until('the phone is let in by itself', (s) => s.connection.ok);
    await server.tell('shut');
    await page.emulateMedia({ colorScheme: 'light' });
    await door(phone.page, '#door', 'Invitation expired', 'Ask whoever runs the session for a new one');
    await page.goto(server.url);
    await door(page, '#empty', 'Invitation expired', 'This invitation has expired: ask for another.', 'Ask whoever runs the session for a new one');
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), 'light');
    assert.equal(await page.locator('#panels').isVisible(), false, 'panels without anything in them');
    await picture(page, 'door');
    await picture(phone.page, 'phone_door');
    assert.deepEqual(await contrastFaults(page), {});
    return server.url;
  },

  async 'keyboard, focus and names for those who do not see it'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    await browser.until('everything is known', (s) => s.synced && s.cameras.length === 45);
    await page.locator('#tab_overview').focus();
    await page.keyboard.press('ArrowRight');
    assert.equal(await page.locator('#tab_maps').getAttribute('aria-selected'), 'true');
    assert.equal(await page.evaluate(() => document.activeElement.id), 'tab_maps');
    assert.notEqual(await page.locator('#tab_maps').evaluate((e) => getComputedStyle(e).outlineStyle), 'none');
    const unnamed = await page.evaluate(() => [...document.querySelectorAll('button, a, input, select, [role]')]
      .filter((e) => e.checkVisibility() && !(e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') || e.innerText?.trim() || e.closest('label')?.innerText.trim() || e.title))
      .map((e) => e.outerHTML.slice(0, 80)));
    assert.deepEqual(unnamed, []);
    await page.keyboard.press('m');
    await page.locator('#notice').filter({ hasText: 'click the first point' }).waitFor();
    await page.keyboard.press('Escape');
    await page.keyboard.press('?');
    await page.locator('dialog[open] p', { hasText: 'Each pyramid is a photo' }).waitFor();
    assert.ok(!/\[object/.test(await page.locator('dialog[open]').innerText()));
    await page.keyboard.press('Escape');
    for (const theme of ['dark', 'light']) {
      if ((await page.locator('html').getAttribute('data-theme')) !== theme) await page.locator('#theme_button').click();
      for (const tab of ['overview', 'maps', 'unplaced', 'inspect']) {
        await page.locator(`#tab_${tab}`).click();
        if (tab === 'inspect') await page.evaluate(() => window.skein.select(17));
        assert.deepEqual(await contrastFaults(page), {}, `${theme}, ${tab}`);
      }
    }
  },

  async 'distances: within a map, in metres where GPS tells, and none between maps'({ browser, start }) {
    const server = await start('--at', 'end', '--gps');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', (s) => s.points > 5000 && s.loading === 0 && s.cameras.length === 45);
    await browser.rest();
    await page.locator('#tool_measure').click();
    // The two doors of the outer houses are 27 m apart: any two points of the picture are less than 60 m.
    const box = await page.locator('#canvas').boundingBox();
    const points = await twoPoints(page);
    for (const { x, y } of points) await page.mouse.click(box.x + x, box.y + y);
    await page.locator('.measure_label').filter({ hasText: /m \(scale from GPS\)\s*height [+−]/ }).waitFor();
    const metres = parseFloat(await page.locator('.measure_label').innerText());
    assert.ok(metres > 5 && metres < 60, `${metres} m`);
    return server.url;
  },

  async 'an area and the volume over it: of the surface, and of sparse points'({ browser, start }) {
    const server = await start('--at', 'end', '--gps', '--depth', '100');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('the map is there', (s) => isShown(s) && s.surface.of.length === 1);
    await page.keyboard.press('p');
    await browser.until('the surface is there', (s) => s.surface.on && s.surface.points > 100000 && s.surface.loading === 0);
    await browser.rest();
    const box = await page.locator('#canvas').boundingBox();
    const corners = await groundCorners(page, { left: 150, right: box.width - 60, top: 200, bottom: box.height - 60, step: 53 });
    assert.ok(corners.length >= 3, JSON.stringify(corners));
    const click = ({ x, y }) => page.mouse.click(box.x + x, box.y + y);
    await page.locator('#tool_measure').click();
    await click(corners[0]); // of a distance, until it is an area
    await page.locator('#measure_area').click();
    await page.locator('#measure_area[aria-pressed="true"]').waitFor();
    assert.equal(await page.locator('#measure_close').isEnabled(), false);
    for (const corner of corners.slice(1)) await click(corner);
    await page.locator('#notice').filter({ hasText: 'Click the next corner, or the first one to close the area.' }).waitFor();
    await page.locator('#measure_close').click();
    const label = page.locator('.measure_label');
    await label.filter({ hasText: /m² \(scale from GPS\)\s*.* above its base, .* below/ }).waitFor();
    assert.match(await label.innerText(), /\d points, cells of/);
    // The street and its gardens are 48 m x 15 m.
    const metres = parseFloat((await label.innerText()).replaceAll('\u202f', ''));
    assert.ok(metres > 5 && metres < 720, `${metres} m²`);
    await picture(page, 'area');
    assert.deepEqual(await contrastFaults(page), {});
    // Opened again, and closed at the first corner.
    await page.locator('#measure_undo').click();
    await label.waitFor({ state: 'detached' });
    await click(corners[0]);
    await label.filter({ hasText: 'm²' }).waitFor();
    await page.keyboard.press('p');
    await label.filter({ hasText: /sparse points?/ }).waitFor();
    // The next click begins another one.
    await click((await twoPoints(page))[0]);
    await label.waitFor({ state: 'detached' });
    await page.keyboard.press('Escape');
    await page.locator('#measure_tools').waitFor({ state: 'hidden' });
    return server.url;
  },

  async 'an area on a phone: by taps, and the map stays where it is'({ openPhone, url }) {
    const browser = await openPhone();
    const { page } = browser;
    await page.goto(url);
    await browser.until('the map is there', isShown);
    await browser.rest();
    await page.locator('#tool_measure').tap();
    await page.locator('#measure_area').tap();
    await browser.rest();
    const stage = await page.locator('#stage').boundingBox();
    const box = await page.locator('#canvas').boundingBox();
    const corners = await groundCorners(page, { left: 20, right: box.width - 20, top: 90, bottom: box.height - 20, step: 6 });
    assert.ok(corners.length >= 3, JSON.stringify(corners));
    for (const { x, y } of corners) await page.touchscreen.tap(box.x + x, box.y + y);
    await page.locator('#notice').filter({ hasText: 'Tap the next corner' }).waitFor();
    assert.deepEqual(await page.locator('#stage').boundingBox(), stage, 'the map moves');
    await page.locator('#measure_close').tap();
    await page.locator('.measure_label').filter({ hasText: /square units[^]*sparse points?/ }).waitFor();
    await browser.rest();
    await picture(page, 'area_phone');
    assert.deepEqual(await page.locator('#stage').boundingBox(), stage, 'the map moves');
    const label = await page.locator('.measure_label').boundingBox();
    assert.ok(label.x >= 0 && label.x + label.width <= 360, 'the area is cut off');
    for (const button of await page.locator('#measure_tools button').all()) {
      const place = await button.boundingBox();
      assert.ok(place.height >= 40 && place.x >= 0 && place.x + place.width <= 360 && place.y + place.height <= 740, JSON.stringify(place));
    }
    assert.deepEqual(await contrastFaults(page), {});
    await page.locator('#measure_done').tap();
    await page.locator('#tabs').waitFor();
    expectClean(browser, url);
    await browser.close();
  },

  async 'a known length gives the scale, and is kept'({ browser, url }) {
    const { page } = browser;
    await page.goto(url);
    await browser.until('the map is there', (s) => s.points > 5000 && s.loading === 0 && s.cameras.length === 45);
    await browser.rest();
    await page.locator('#scale_text').filter({ hasText: /unit/ }).waitFor();
    assert.equal(await page.locator('#known_length').isVisible(), false);
    await page.locator('#tool_measure').click();
    const box = await page.locator('#canvas').boundingBox();
    for (const { x, y } of await twoPoints(page)) await page.mouse.click(box.x + x, box.y + y);
    await page.locator('.measure_label').filter({ hasText: /units?$/ }).waitFor();
    await picture(page, 'known_length_asked');
    await page.locator('#known_length input').fill('0');
    await page.keyboard.press('Enter');
    await page.locator('#notice').filter({ hasText: 'above 0' }).waitFor();
    await page.locator('#known_length input').fill('12.5');
    await page.keyboard.press('Enter');
    await page.locator('.measure_label').filter({ hasText: '12.5 m (scale from a known length)' }).waitFor();
    const inMetres = (on) => on.locator('#scale_text').filter({ hasText: / (mm|cm|m|km)$/ }).waitFor();
    const inUnits = (on) => on.locator('#scale_text').filter({ hasText: /unit/ }).waitFor();
    await inMetres(page);
    await page.locator('#known_length').filter({ hasText: 'This browser keeps the scale' }).waitFor();
    for (const theme of ['dark', 'light']) {
      if ((await page.locator('html').getAttribute('data-theme')) !== theme) await page.locator('#theme_button').click();
      assert.deepEqual(await contrastFaults(page), {}, theme);
      await picture(page, `known_length_${theme}`);
    }
    // A reload has it, and so has another page, while it is open and when it is opened.
    const other = await page.context().newPage();
    await other.goto(url);
    await inMetres(other);
    await page.reload();
    await inMetres(page);
    // Forgotten here, it is forgotten there.
    await browser.until('the map is there', isShown);
    await browser.rest();
    await page.locator('#tool_measure').click();
    for (const { x, y } of await twoPoints(page)) await page.mouse.click(box.x + x, box.y + y);
    await page.locator('.measure_label').filter({ hasText: 'from a known length' }).waitFor();
    await page.locator('#known_length button', { hasText: 'Forget it' }).click();
    await page.locator('.measure_label').filter({ hasText: /units?$/ }).waitFor();
    await inUnits(page);
    await inUnits(other);
    await other.close();
  },

  async 'a known length on a phone: nothing lies over anything, and the map is seen'({ openPhone, url }) {
    const browser = await openPhone();
    const { page } = browser;
    await page.goto(url);
    await browser.until('the map is there', isShown);
    await page.locator('#tab_overview').tap(); // the panels are open
    await browser.rest();
    await page.locator('#tool_measure').tap();
    await browser.rest();
    const stage = await page.locator('#stage').boundingBox();
    assert.ok(stage.height > 0.6 * 740, `of the map ${stage.height} px are left`);
    const box = await page.locator('#canvas').boundingBox();
    const points = await twoPoints(page, { left: 20, right: box.width - 20, top: box.height * 0.55, bottom: box.height - 20, step: 11 });
    for (const { x, y } of points) await page.touchscreen.tap(box.x + x, box.y + y);
    const nothingIsOver = async (when) => {
      await picture(page, `known_length_phone_${when}`);
      assert.deepEqual(await page.locator('#stage').boundingBox(), stage, `${when}: the map moves`);
      const boxes = await Promise.all(['#tools', '#notice', '#measure_done', '#known_length', '#scale'].map(async (id) => [id, await page.locator(id).boundingBox()]));
      for (const [a, p] of boxes) {
        for (const [b, q] of boxes) {
          const apart = a === b || p.x + p.width <= q.x || q.x + q.width <= p.x || p.y + p.height <= q.y || q.y + q.height <= p.y;
          assert.ok(apart, `${when}: ${a} lies over ${b}`);
        }
        assert.ok(p.x >= 0 && p.x + p.width <= 360, `${when}: ${a} is cut off`);
        assert.ok(p.y + p.height <= 740, `${when}: ${a} is below the screen`);
        const isBelow = p.y >= stage.y + stage.height;
        assert.ok(isBelow || ['#tools', '#scale'].includes(a), `${when}: ${a} lies over the map`);
      }
      const small = await page.evaluate(() => [...document.querySelectorAll('#known_length button, #known_length input, #measure_done')].filter((e) => e.checkVisibility() && e.getBoundingClientRect().height < 40).length);
      assert.equal(small, 0, 'too small for fingers');
    };
    await page.locator('#known_length input').waitFor();
    await nothingIsOver('asked');
    await page.locator('#known_length input').fill('12.5');
    await page.keyboard.press('Enter');
    await page.locator('.measure_label').filter({ hasText: '12.5 m' }).waitFor();
    await nothingIsOver('given');
    await browser.rest();
    const label = await page.locator('.measure_label').boundingBox();
    assert.ok(label.x >= 0 && label.x + label.width <= 360, 'the length is cut off');
    for (const theme of ['light', 'dark']) {
      if ((await page.locator('html').getAttribute('data-theme')) !== theme) await page.locator('#theme_button').tap();
      await picture(page, `known_length_phone_${theme}`);
      assert.deepEqual(await contrastFaults(page), {}, theme);
    }
    await page.locator('#measure_done').tap();
    await page.locator('#tabs').waitFor();
    assert.equal(await page.locator('#notice').isVisible(), false);
    expectClean(browser, url);
    await browser.close();
  },

  async 'flying: keys move the eye where it looks, the mouse turns it on the spot'({ browser, url }) {
    const { page } = browser;
    await page.emulateMedia({ reducedMotion: 'no-preference' });
    await page.goto(url);
    await browser.until('the map is there', isShown);
    const start = await view(browser);
    await page.keyboard.press('v');
    assert.equal(await page.locator('#tool_fly').getAttribute('aria-pressed'), 'true');
    assert.equal(await page.evaluate(() => document.activeElement.id), 'canvas', 'the keys go elsewhere');
    for (const [key, axis] of [['w', 'forward'], ['s', 'forward'], ['d', 'right'], ['a', 'right'], ['e', null], ['q', null]]) {
      const sign = 'wde'.includes(key) ? 1 : -1;
      const before = await view(browser);
      const way = axis ? before[axis] : [0, 1, 0];
      await page.keyboard.down(key);
      await browser.until(`${key} moves the eye`, (s) => far(minus(s.view.eye, before.eye)) > 0.3);
      await page.keyboard.up(key);
      const after = await view(browser);
      const moved = minus(after.eye, before.eye);
      assert.ok(sign * dot(moved, way) > 0.999 * far(moved), `${key} moves the eye by ${moved}`);
      assert.ok(far(minus(after.forward, before.forward)) < 1e-3 && Math.abs(after.distance - before.distance) < 1e-3, `${key} turns the eye`);
    }
    const box = await page.locator('#canvas').boundingBox();
    const drag = async (dx, dy) => {
      await page.mouse.move(box.x + 420, box.y + 380);
      await page.mouse.down();
      await page.mouse.move(box.x + 420 + dx, box.y + 380 + dy, { steps: 6 });
      await page.mouse.up();
    };
    const before = await view(browser);
    await drag(120, 40);
    const after = await view(browser);
    assert.ok(far(minus(after.eye, before.eye)) < 1e-3 * before.distance, 'the eye does not stay where it is');
    // What is under the pointer goes with it: a drag to the right and down looks to the left and up.
    assert.ok(dot(after.forward, before.right) < -0.05 && dot(after.forward, before.up) > 0.02, 'it looks the other way');
    assert.equal((await browser.state()).selection, null, 'a drag is taken for a click');
    // No more: a drag turns the map around its middle again.
    await page.keyboard.press('v');
    await drag(120, 0);
    const turned = await view(browser);
    assert.ok(!turned.flying && far(minus(turned.target, after.target)) < 1e-3 * after.distance && far(minus(turned.eye, after.eye)) > 0.1);
    await page.keyboard.press('f');
    const back = await view(browser);
    assert.ok(Math.abs(back.distance / start.distance - 1) < 0.5, 'F does not show everything');
  },

  async 'fingers: one turns, two zoom and move, none of them clicks'({ openPhone, url }) {
    const browser = await openPhone();
    const { page } = browser;
    await page.emulateMedia({ reducedMotion: 'no-preference' });
    await page.goto(url);
    await browser.until('the map is there', isShown);
    const box = await page.locator('#canvas').boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    const fingers = await fingersOn(page);
    const gesture = async (from, to) => {
      const before = await view(browser);
      await fingers.put(from);
      await fingers.move(from, to);
      await fingers.lift();
      return [before, await view(browser)];
    };
    let [before, after] = await gesture([[x - 40, y], [x + 40, y]], [[x - 120, y], [x + 120, y]]);
    assert.ok(Math.abs(after.distance / before.distance - 1 / 3) < 0.02, `apart: ${before.distance} to ${after.distance}`);
    assert.ok(far(minus(after.target, before.target)) < 0.02 * before.distance && far(minus(after.forward, before.forward)) < 1e-3, 'a zoom about the middle moves it');
    [before, after] = await gesture([[x - 120, y], [x + 120, y]], [[x - 40, y], [x + 40, y]]);
    assert.ok(Math.abs(after.distance / before.distance - 3) < 0.2, `together: ${before.distance} to ${after.distance}`);
    [before, after] = await gesture([[x - 50, y], [x + 50, y]], [[x + 10, y + 40], [x + 110, y + 40]]);
    const moved = minus(after.target, before.target);
    const perPx = (2 * before.distance * Math.tan((21 * Math.PI) / 180)) / box.height;
    assert.ok(Math.abs(after.distance / before.distance - 1) < 0.01 && far(minus(after.forward, before.forward)) < 1e-3, 'two fingers side by side zoom or turn');
    assert.ok(Math.abs(dot(moved, before.right) / perPx + 60) < 3 && Math.abs(dot(moved, before.up) / perPx - 40) < 3, 'the map does not stay under the fingers');
    [before, after] = await gesture([[x, y]], [[x + 70, y]]);
    assert.ok(far(minus(after.target, before.target)) < 1e-3 * before.distance && Math.abs(after.yaw - before.yaw) > 0.2, 'one finger does not turn');
    // The second finger comes later and leaves first.
    before = await view(browser);
    await fingers.put([[x, y]]);
    await fingers.move([[x, y]], [[x + 20, y]]);
    await fingers.put([[x + 20, y], [x + 100, y]]);
    await fingers.move([[x + 20, y], [x + 100, y]], [[x + 20, y], [x + 140, y]]);
    await fingers.put([[x + 20, y]]);
    await fingers.lift();
    after = await view(browser);
    assert.ok(Math.abs(after.distance / before.distance - 80 / 120) < 0.05, `${before.distance} to ${after.distance}`);
    assert.equal((await browser.state()).selection, null, 'a gesture is taken for a tap');
    assert.equal(await page.evaluate(() => visualViewport.scale), 1, 'the page itself is zoomed');
    assert.equal(await page.evaluate(() => scrollX + scrollY), 0, 'the page itself is moved');
    // A tap is a click.
    const at = await page.evaluate(() => window.skein.state().cameras.map((image) => ({ image, ...window.skein.project(image) }))
      .find(({ image, x: px, y: py }) => window.skein.pickAt(px, py)?.image === image));
    await fingers.put([[box.x + at.x, box.y + at.y]]);
    await fingers.lift();
    await browser.until('the tapped camera is selected', (s) => s.selection?.image === at.image);
    expectClean(browser, url);
    await browser.close();
  },

  async 'the newest photo has a card with its picture'({ browser, start, openPhone }) {
    const server = await start('--speed', '12', '--hold=-1,12');
    const { page } = browser;
    await page.goto(server.url);
    await browser.until('it is connected', (s) => s.synced);
    assert.equal(await page.locator('#newest').isVisible(), false, 'a card of no photo');
    await server.tell('go');
    await browser.until('time stands still', (s) => s.counts.placed >= 4 && s.loading === 0);
    const shows = async (on, image) => {
      await on.page.locator(`#newest img[src^="/api/photos/${image}/thumbnail?"]`).waitFor();
      const size = await on.page.locator('#newest img').evaluate((img) => img.decode().then(() => [img.naturalWidth, img.naturalHeight]));
      assert.ok(size[0] > 0 && size[0] <= 320 && size[1] > 0 && size[1] <= 320, `a picture of ${size}`);
      await on.page.locator('#newest', { hasText: /Newest/ }).filter({ hasText: /placed after .*s/ }).waitFor();
    };
    await browser.rest();
    const first = (await browser.state()).newest;
    await shows(browser, first);
    await server.tell('go');
    const { newest } = await browser.until('all photos are placed', (s) => s.cameras.length === 45 && s.loading === 0 && s.newest !== first);
    await shows(browser, newest);
    const before = await view(browser);
    await page.locator('#newest').click();
    await browser.until('its photo is shown', (s) => s.selection?.image === newest);
    const after = await view(browser);
    assert.ok(far(minus(after.eye, before.eye)) > 0.1, 'the camera is not looked at');
    // As it was: the card is of that time.
    await goBack(page);
    const past = await browser.until('an earlier time', (s) => !s.isLive && s.newest !== newest && s.newest > 0);
    await shows(browser, past.newest);
    // On a phone it is in the way of nothing.
    const phone = await openPhone();
    await phone.page.goto(server.url);
    await phone.until('the map is there', isShown);
    await shows(phone, newest);
    const card = await phone.page.locator('#newest').boundingBox();
    for (const other of ['#tools', '#scale', '#timeline']) {
      const box = await phone.page.locator(other).boundingBox();
      const apart = card.x + card.width <= box.x || box.x + box.width <= card.x || card.y + card.height <= box.y || box.y + box.height <= card.y;
      assert.ok(apart, `the card lies over ${other}`);
    }
    assert.deepEqual(await contrastFaults(phone.page), {});
    expectClean(phone, server.url);
    await phone.close();
    return server.url;
  },

  async 'without WebGL the panels work, and it is said'({ openOther, url }) {
    const browser = await openOther({ more: ['--disable-3d-apis'] });
    await browser.page.goto(url);
    await browser.until('everything is known', (s) => s.synced && s.counts.received === 49);
    await browser.page.locator('#notice').filter({ hasText: 'No 3D' }).waitFor();
    await browser.page.locator('#tab_unplaced').click();
    await browser.page.locator('.unplaced_list li').nth(3).waitFor();
    expectClean({ hosts: browser.hosts, faults: browser.faults.filter((f) => !/WebGLRenderer: /.test(f)) }, url);
    await browser.close();
  },

  async 'the camera view: the next step, the photo to stand at, one shutter'({ browser: other, openOther, start }) {
    const server = await start('--at', 'end');
    const { film, remove } = await filmOf(4, other.page);
    const browser = await openOther({ ...kCamera, more: [...kCamera.more, `--use-file-for-fake-video-capture=${film}`] });
    const { page } = browser;
    await page.goto(`${server.url}phone`);
    await browser.until('the server has answered', (s) => s.connection.ok);
    assert.equal(await page.locator('#open_camera').evaluate((b) => b.classList.contains('primary')), true);
    await page.locator('#open_camera').click();
    await browser.until('the camera is open, with the photo to stand at', (s) => s.camera && s.ghost === 47);
    await page.locator('#camera_advice').filter({ hasText: '2 steps to the right' }).waitFor();
    const fits = await page.evaluate(() => {
      const [video, ghost, shutter, camera] = ['video', 'ghost', 'shutter', 'camera'].map((id) => document.getElementById(id).getBoundingClientRect());
      const isSame = ['left', 'top', 'width', 'height'].every((k) => Math.abs(video[k] - ghost[k]) < 1);
      return { isSame, isWhole: camera.width === innerWidth && camera.height === innerHeight, shutter: shutter.bottom <= innerHeight, opacity: Number(getComputedStyle(document.getElementById('ghost')).opacity) };
    });
    assert.ok(fits.isSame && fits.isWhole && fits.shutter && fits.opacity > 0.2 && fits.opacity < 0.6, JSON.stringify(fits));
    await page.locator('#ghost').evaluate((img) => img.decode());
    await picture(page, 'camera_view');
    assert.deepEqual(await contrastFaults(page), {});
    await page.locator('#ghost_switch').click();
    assert.equal(await page.locator('#ghost').isVisible(), false);
    await page.locator('#ghost_switch').click();
    // One shutter: a photo, or a series that it begins and ends.
    assert.equal(await page.locator('#camera button[aria-label]').count(), 1);
    await page.getByRole('button', { name: 'Take a photo' }).click();
    await browser.until('a photo is taken', (s) => s.counts.taken === 1);
    await page.locator('#series').click();
    await page.getByRole('button', { name: 'Start the series' }).click();
    await browser.until('a series is taken', (s) => s.series && s.counts.taken >= 3);
    await picture(page, 'camera_series');
    await page.getByRole('button', { name: 'Stop the series' }).click();
    await browser.until('it ends', (s) => !s.series);
    await page.locator('#camera_counts').filter({ hasText: / taken, 0 placed$/ }).waitFor();
    await server.tell('full');
    await page.locator('#camera_note').filter({ hasText: 'the disk is almost full' }).waitFor();
    await server.tell('obey');
    await page.locator('#camera_note').filter({ hasText: /^$/ }).waitFor();
    // A photo of somebody else is no ghost; without advice there is neither.
    await server.tell('unadvised');
    await browser.until('no advice, no photo', (s) => s.ghost === 0);
    assert.equal(await page.locator('#camera_advice').isVisible(), false);
    await server.tell('obey');
    await browser.until('both are back', (s) => s.ghost === 47);
    await server.tell('unadvised');
    await server.tell('private');
    await browser.until('it is gone', (s) => s.ghost === 0);
    await server.tell('obey');
    await server.tell('private');
    await page.locator('#camera_advice').waitFor();
    assert.equal((await browser.state()).ghost, 0);
    assert.equal(await page.locator('#ghost_switch').isVisible(), false);
    // The page opens without a network once the browser keeps it.
    await browser.until('the page is kept', (s) => s.opensOffline);
    await page.locator('#close_camera').click();
    assert.equal(await page.locator('#keep_open').isVisible(), false);
    await browser.until('all are received', (s) => s.counts.received === s.counts.taken);
    await page.context().setOffline(true);
    await page.reload();
    await browser.until('it opens without a network', (s) => s.counts.taken >= 3);
    await page.context().setOffline(false);
    expectClean(browser, server.url);
    await browser.close();
    remove();
  },

  async 'a phone whose server says nothing opens its page and keeps photos'({ openPhone, start }) {
    const server = await start('--at', 'end');
    const browser = await openPhone();
    const { page } = browser;
    await page.goto(`${server.url}phone`);
    await browser.until('the browser keeps the page', (s) => s.connection.ok && s.opensOffline);
    await page.reload(); // the worker has the page from here on
    await browser.until('the page is back', (s) => s.connection.ok);
    await server.tell('mute');
    const began = Date.now();
    await page.reload({ waitUntil: 'commit' });
    await page.locator('#choose').waitFor({ state: 'attached' });
    await page.locator('#page').waitFor();
    assert.ok(Date.now() - began < 60000, 'it waits for TCP to give up');
    await page.locator('#choose').setInputFiles({ name: 'a.jpg', mimeType: 'image/jpeg', buffer: Buffer.from('no matter') });
    await browser.until('it is kept', (s) => s.counts.taken === 1);
    await server.tell('obey');
    await browser.until('it is sent', (s) => s.counts.received === 1);
    expectClean(browser, server.url);
  },

  async 'a phone without https: what that would add, and a warning before a reload'({ openOther, start }) {
    const server = await start('--at', 'end');
    // Loopback's own name counts as safe.
    const url = `http://phone.test:${new URL(server.url).port}/phone`;
    const browser = await openOther({ ...kCamera, theme: 'light', more: [...kCamera.more, '--host-resolver-rules=MAP phone.test 127.0.0.1'] });
    const { page } = browser;
    await page.goto(url);
    await browser.until('the server has answered', (s) => s.connection.ok && s.opensOffline === false);
    assert.equal(await page.evaluate(() => isSecureContext), false);
    const line = page.locator('#secure_line');
    await line.filter({ hasText: 'The https page adds a camera view with the next step, series, position and reloading without a network' }).waitFor();
    assert.match(await line.locator('a').getAttribute('href'), /^https:.*\/phone$/);
    await page.locator('#keep_open').filter({ hasText: 'without a network it does not open again' }).waitFor();
    const isAsked = () => page.evaluate(() => !dispatchEvent(new Event('beforeunload', { cancelable: true })));
    assert.equal(await isAsked(), false);
    await page.context().setOffline(true);
    await browser.until('the network is gone', (s) => s.connection.ok === false);
    assert.equal(await isAsked(), true, 'the page goes without a word');
    await page.locator('#keep_open.bad').waitFor();
    await page.locator('#choose').setInputFiles({ name: 'a.jpg', mimeType: 'image/jpeg', buffer: Buffer.from('no matter') });
    await page.locator('#note').filter({ hasText: 'No connection: 1 photo waits on this phone' }).waitFor();
    await picture(page, 'phone_offline');
    assert.deepEqual(await contrastFaults(page), {});
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'the page is wider than a phone');
    await page.context().setOffline(false);
    await browser.until('it is sent', (s) => s.counts.received === 1);
    assert.equal(await isAsked(), false);
    expectClean(browser, url);
    await browser.close();
  },

  async 'a phone: nothing is cut off, the panels are a sheet'({ openPhone, url }) {
    const browser = await openPhone();
    const { page } = browser;
    await page.goto(url);
    await browser.until('everything is known', (s) => s.synced && s.cameras.length === 45);
    const wide = () => page.evaluate(() => Math.max(document.documentElement.scrollWidth, document.body.scrollWidth) - innerWidth);
    assert.equal(await wide(), 0);
    for (const tab of ['overview', 'maps', 'unplaced', 'inspect']) {
      await page.locator(`#tab_${tab}`).tap();
      if (tab === 'inspect') await page.evaluate(() => window.skein.select(20));
      await page.locator(`#panel_${tab}`).waitFor();
      assert.equal(await wide(), 0, tab);
      const cut = await page.evaluate((id) => {
        const panel = document.getElementById(id);
        return panel.scrollWidth - panel.clientWidth;
      }, `panel_${tab}`);
      assert.ok(cut <= 0, `${tab} is ${cut} px too wide`);
      assert.ok((await page.locator('#stage').boundingBox()).height > 120);
    }
    await page.locator('#sheet_handle').tap();
    assert.equal(await page.evaluate(() => document.body.dataset.sheet), 'full');
    const small = await page.evaluate(() => [...document.querySelectorAll('#tools button, #tabs button')]
      .map((b) => b.getBoundingClientRect()).filter((b) => b.height > 0 && b.height < 40).length);
    assert.equal(small, 0, 'buttons too small for fingers');
    expectClean(browser, url);
    await browser.close();
  },
};

const still = await startServer('--at', 'end');
const chromium = await startChromium();
let failed = 0;
for (const [name, run] of Object.entries(cases)) {
  if (!name.includes(only)) continue;
  const began = Date.now();
  const opened = [];
  const open = async (looks = {}) => {
    opened.push(await chromium.open({ reducedMotion: 'reduce', ...looks })); // the view and colours change at once
    return opened.at(-1);
  };
  const browser = await open();
  const servers = [];
  const start = async (...more) => {
    servers.push(await startServer(...more));
    return servers.at(-1);
  };
  try {
    const url = (await run({ browser, url: still.url, start, openOther: openBrowser, openPhone: () => open(kPhone) })) ?? still.url;
    if (browser.hosts.size > 0) expectClean(browser, url);
    console.log(`ok: ${name} (${((Date.now() - began) / 1000).toFixed(1)} s)`);
  } catch (error) {
    failed++;
    console.log(`FAILED: ${name}\n${error.stack}\n${browser.faults.join('\n')}`);
  }
  for (const server of servers) server.stop(); // also of a case that failed: who waits for their output waits for them
  for (const page of opened) await page.close();
}
still.stop();
await chromium.close();
process.exit(failed ? 1 : 0);
