// The page of a session that `skein view` shows: node finished.mjs URL REPORT. It has what the report tells.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { expectClean, openBrowser } from './browser.mjs';

const [url, reportPath] = process.argv.slice(2);
const report = JSON.parse(readFileSync(reportPath));
const browser = await openBrowser();
await browser.page.goto(url);
const state = await browser.until('the finished map', (s) =>
  s.synced && s.finish?.state === 'done' && s.points > 0 && s.loading === 0 && s.cameras.length === report.images.registered);
assert.equal(state.counts.received, report.images.received);
await browser.rest();
const pixels = await browser.page.evaluate(() => window.skein.pixels());
assert.ok(pixels.painted > 0.005 && pixels.colours > 50, `an empty picture: ${JSON.stringify(pixels)}`);
expectClean(browser, url);
await browser.close();
console.log(`the page shows ${state.cameras.length} photos and ${state.points} points`);
