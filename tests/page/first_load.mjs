// What a browser that was never here loads, and when it shows something: node first_load.mjs URL RUNS
// A line of JSON a run. Bytes are those on the wire, times are from the start of navigation.
import { openBrowser } from './browser.mjs';

const [url, runs] = process.argv.slice(2);

async function load() {
  const browser = await openBrowser({ antialias: true });
  const { page, hosts } = browser;
  const bytes = { page: 0, thumbnails: 0, facts: 0, points: 0 };
  const kinds = new Map();
  const network = await page.context().newCDPSession(page);
  await network.send('Network.enable');
  network.on('Network.responseReceived', ({ requestId, response }) => {
    const path = new URL(response.url).pathname;
    kinds.set(requestId, /^\/api\/submaps\//.test(path) ? 'points' : /^\/api\/photos\//.test(path) ? 'thumbnails' : /^\/api\//.test(path) ? 'facts' : 'page');
  });
  network.on('Network.loadingFinished', ({ requestId, encodedDataLength }) => {
    bytes[kinds.get(requestId) ?? 'page'] += encodedDataLength;
  });
  network.on('Network.webSocketFrameReceived', ({ response }) => (bytes.facts += response.payloadData.length));
  const began = Date.now();
  const seconds = async (holds) => {
    await page.waitForFunction(holds, null, { polling: 'raf' });
    return (Date.now() - began) / 1000;
  };
  await page.goto(url, { waitUntil: 'commit' });
  const result = {
    panels_s: await seconds(() => window.skein?.state().counts.received > 0),
    points_s: await seconds(() => window.skein.state().points > 0 && window.skein.state().framesDrawn > 0),
    all_s: await seconds(() => window.skein.state().synced && window.skein.state().shapes.length > 0 && window.skein.state().loading === 0),
    points: (await browser.state()).points,
    bytes, hosts: [...hosts],
  };
  await browser.close();
  return result;
}

for (let i = 0; i < Number(runs); ++i) console.log(JSON.stringify(await load()));
