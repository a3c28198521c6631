// The page's side of tests/process/invite_test.sh: node invite.mjs URL OUT PHOTO. The view's button makes an invitation; what
// a phone reads of its QR code is what it opens.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { join } from 'node:path';
import { contrastFaults, expectClean, startChromium } from './browser.mjs';

const [url, out, photo] = process.argv.slice(2);
// What is written in the picture's code.
const read = (picture) => execFileSync('zbarimg', ['--quiet', '--nodbus', '--raw', '-Sdisable', '-Sqrcode.enable', picture], { encoding: 'utf8' }).trimEnd();

const chromium = await startChromium({ more: ['--ignore-certificate-errors'] });
const links = {};
for (const [name, options] of [['wide', { theme: 'dark' }], ['narrow', { width: 360, height: 740, theme: 'light' }]]) {
  const browser = await chromium.open(options);
  const { page } = browser;
  await page.goto(url);
  await browser.until('it is connected', (s) => s.connected);
  await page.locator('#invite_button').click();
  for (const [role, label] of [['agent', 'A phone that takes photos'], ['viewer', 'Somebody who looks']]) {
    await page.locator('dialog[open] button', { hasText: label }).click();
    const code = page.locator(`.invitation[data-role="${role}"] .qr`);
    await code.waitFor();
    await code.scrollIntoViewIfNeeded();
    const picture = join(out, `${name}_${role}.png`);
    await page.screenshot({ path: picture }); // as a phone's camera sees the screen
    const link = await page.locator('.invitation code').first().innerText();
    assert.equal(read(picture), link, `the code of ${role} is another link than the one below it`);
    assert.ok(!Object.values(links).includes(link), 'two invitations are one');
    links[`${name}_${role}`] = link;
    assert.deepEqual(await contrastFaults(page), {});
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0, 'wider than the screen');
    assert.equal(await page.locator('#dialog').evaluate((d) => Math.max(0, d.scrollWidth - d.clientWidth)), 0, 'the dialog is cut off');
  }
  await page.keyboard.press('Escape');
  assert.equal(await page.locator('dialog[open]').count(), 0);
  assert.equal(await page.evaluate(() => document.activeElement.id), 'invite_button', 'the focus is lost');
  expectClean(browser, url);
  await browser.close();
}

const phone = await chromium.open({ width: 390, height: 844 });
await phone.page.goto(links.wide_agent);
await phone.until('the phone is let in', (s) => s.photos?.length === 0);
await phone.page.locator('#choose').setInputFiles(photo);
await phone.until('its photo is received', (s) => s.counts.received === 1);
expectClean(phone, links.wide_agent);
await phone.close();
const viewer = await chromium.open();
await viewer.page.goto(links.narrow_viewer);
await viewer.until('who looks is let in', (s) => s.connected && s.counts.received === 1);
assert.equal(await viewer.page.locator('#invite_button').isVisible(), false, 'who looks may invite');
expectClean(viewer, links.narrow_viewer);
await viewer.close();
await chromium.close();
console.log('4 invitations, each read from its QR code');
