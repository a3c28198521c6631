// The page's side of tests/process/page_test.sh: node live.mjs URL STEPS SESSION
import assert from 'node:assert/strict';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { expectClean, openBrowser } from './browser.mjs';

const [url, steps, session] = process.argv.slice(2);
const told = (name) => writeFileSync(join(steps, name), '');
async function heard(name, deadlineS = 240) {
  for (const end = Date.now() + deadlineS * 1000; !existsSync(join(steps, name));) {
    assert.ok(Date.now() < end, `not within ${deadlineS} s: ${name}`);
    await new Promise((r) => setTimeout(r, 100));
  }
}
const picture = async (name) => process.env.PAGE_PICTURES && browser.page.screenshot({ path: join(process.env.PAGE_PICTURES, `${name}.png`) });

const browser = await openBrowser({ width: 1440, height: 900 });
const { page } = browser;
await page.goto(url);
await browser.until('the page is connected', (s) => s.connected && s.synced);
told('open');

await heard('two_maps');
let state = await browser.until('both maps with their points and cameras', (s) =>
  s.shapes.length === 2 && s.points > 300 && s.loading === 0 && s.cameras.length >= 10 && s.cameras.length === s.counts.placed);
state = await browser.until('the photo without texture', (s) => s.unplaced.length >= 1);
await browser.rest();
await picture('two_maps');
const pixels = await page.evaluate(() => window.skein.pixels());
assert.ok(pixels.painted > 0.005 && pixels.colours > 50, `an empty picture: ${JSON.stringify(pixels)}`);
const found = await page.evaluate((images) => images.filter((image) => {
  const at = window.skein.project(image);
  return at && window.skein.pickAt(at.x, at.y)?.image === image;
}), state.cameras);
assert.ok(found.length >= 0.5 * state.cameras.length, `only ${found.length} of ${state.cameras.length} cameras are found where they are seen`);
await page.waitForFunction(() => { // another photo may become the newest meanwhile
  const picture = document.querySelector('#newest img');
  return picture?.naturalWidth > 0 && picture.getAttribute('src').startsWith(`/api/photos/${window.skein.state().newest}/thumbnail?`);
});
const box = await page.locator('#canvas').boundingBox();
const at = await page.evaluate((image) => window.skein.project(image), found[0]);
await page.mouse.click(box.x + at.x, box.y + at.y);
await browser.until('the clicked camera is selected', (s) => s.selection?.image === found[0]);
await page.locator('.inspect .verdict.placed').waitFor();
await page.locator('.inspect img').first().evaluate((img) => img.decode());
await page.locator('.matches li button').first().click();
await page.locator('.match_line').first().waitFor({ state: 'attached' });
await picture('compare');
await page.keyboard.press('Escape');
await page.locator('#tab_unplaced').click();
await page.locator('.unplaced_list li').filter({ hasText: 'Nothing to recognise' }).waitFor();
await picture('unplaced');
assert.equal(await page.locator('img[src="x"]').count(), 0);
const connections = state.connections;
told('both_shown');

await heard('killed');
state = await browser.until('the page is connected anew', (s) => s.connected && s.connections > connections);
told('back');

await heard('restarted');
const connectedBefore = state.connections;
await browser.until('the page is connected to the services that were started again', (s) =>
  s.connected && s.connections > connectedBefore && s.synced && s.cameras.length === s.counts.placed && s.loading === 0);
told('back_again');

await heard('finished');
const report = JSON.parse(readFileSync(join(session, 'report.json')));
const status = JSON.parse(readFileSync(join(steps, 'status.json'), 'utf8').trim().split('\n').pop());
const { received, registered, deferred, failed } = report.images;
const points = report.submaps.reduce((n, s) => n + s.points, 0);
const ids = (submaps) => submaps.map((s) => s.id).sort().join();
state = await browser.until(`all that the ledger has, ${points} points`, (s) => s.head >= status.ledger - 1 && s.finish?.state === 'done' &&
  s.joining.length === 0 && s.loading === 0 && s.cameras.length === registered && [...s.shapes].sort().join() === ids(status.submaps) &&
  Math.abs(s.points - points) <= 0.02 * points);
assert.deepEqual(
  { received: state.counts.received, placed: state.counts.placed, waiting: state.counts.waiting, notPlaced: state.notPlaced },
  { received, placed: registered, waiting: 0, notPlaced: deferred + failed });
assert.deepEqual(state.submaps.map((s) => [s.id, s.registered]).sort(), status.submaps.map((s) => [s.id, s.images]).sort());
assert.equal(state.merges.filter((m) => m.state === 'done').length, report.merges.filter((m) => m.state === 'done').length);
// By a merge, or by one map that took all photos in the finish.
assert.equal(report.submaps.length, 1, 'the maps were not joined');
await page.locator('#tool_fit').click();
await browser.rest();
await page.locator('#tab_overview').click();
await browser.rest();
await picture('finished');
await page.locator('#tool_surface').click();
state = await browser.until('the surface', (s) => s.surface.on && s.surface.points > 20_000 && s.surface.loading === 0);
await browser.rest();
await picture('surface');
await browser.until('a mesh is listed', (s) => s.mesh.of.length === 1); // the last work of skein-dense
await page.locator('#tool_surface').click();
await browser.until('the mesh', (s) => s.mesh.on && s.mesh.triangles > 20_000 && s.mesh.loading === 0);
await browser.rest();
await picture('mesh');
await page.locator('#tool_surface').click();
await browser.until('the points again', (s) => !s.surface.on && !s.mesh.on);
await browser.rest();
const point = await page.evaluate(() => {
  for (let y = 150; y < 700; y += 4) {
    for (let x = 150; x < 950; x += 4) {
      const hit = window.skein.pickAt(x, y);
      if (hit?.chunk !== undefined) return { x, y };
    }
  }
  return null;
});
await page.mouse.click(box.x + point.x, box.y + point.y);
await browser.until('the photos that see the point', (s) => s.selection?.seen?.photos?.length >= 2);
await picture('point');
told('all_shown');

await heard('stopped');
await page.locator('#connection.lost').filter({ hasText: /Not connected: last heard/ }).waitFor();
expectClean(browser, url);
await browser.close();
console.log(`the page showed ${registered} of ${received} photos and ${state.points} points, as the ledger has them`);
