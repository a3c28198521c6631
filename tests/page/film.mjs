// A picture of the live view every few seconds, until its standard input ends: node film.mjs URL FOLDER PERIOD_S [SHOWN]
// SHOWN: points, surface or mesh.
import { join } from 'node:path';
import { openBrowser } from './browser.mjs';

const [url, folder, periodS, shown = 'points'] = process.argv.slice(2);
let goesOn = true;
process.stdin.on('end', () => (goesOn = false)).resume();

const browser = await openBrowser({ width: 960, height: 600, antialias: true });
await browser.page.addInitScript((choice) => localStorage.setItem('skein.points', choice), shown);
await browser.page.goto(url);
await browser.until('the page is connected', (s) => s.connected && s.synced);
for (let n = 0; goesOn; ++n) {
  const next = Date.now() + periodS * 1000;
  await browser.page.screenshot({ path: join(folder, `${String(n).padStart(5, '0')}.png`) });
  while (goesOn && Date.now() < next) await new Promise((r) => setTimeout(r, 50));
}
// skein-dense works at the lowest priority, the mesh last.
if (shown === 'mesh') await browser.until('the mesh', (s) => s.mesh.triangles > 0 && s.mesh.loading === 0, 300);
await browser.rest();
await browser.page.screenshot({ path: join(folder, '99999.png') });
await browser.close();
