// The phone of benchmark/live/phone_link.sh: node phone_link.mjs LINK PHOTOS
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { openBrowser } from './browser.mjs';

const [link, folder] = process.argv.slice(2);
const photos = readdirSync(folder).sort().map((name) => join(folder, name));
const phone = await openBrowser({ width: 390, height: 844 });
await phone.page.goto(link);
await phone.until('the phone is let in', (s) => s.photos.length === 0);
const began = Date.now();
await phone.page.locator('#choose').setInputFiles(photos);
await phone.until('all are kept on the phone', (s) => s.counts.taken === photos.length && s.adding === 0, 600);
console.log(`kept on the phone after ${((Date.now() - began) / 1000).toFixed(0)} s`);
await phone.until('all are received', (s) => s.counts.received === photos.length, 900);
console.log(`received after ${((Date.now() - began) / 1000).toFixed(0)} s`);
await phone.close();
