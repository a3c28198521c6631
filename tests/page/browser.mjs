// A headless Chromium with the page in it, and what must hold on every page: nothing is asked of another host, no error
// stands in the console, no dialog opens by itself. WebGL is software here: state and pixels are looked at, never
// frames a second.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const { chromium } = createRequire(join(process.env.SKEIN_WEB_MODULES, 'any.js'))('playwright-core');

const kPatienceMs = 90000; // of a busy machine

// What Playwright switches off, since a list of one's own replaces its list; and the popups of the address bar, which
// nobody sees: Chromium loads them as pages of their own for each window, at more than a second of a core.
const kOff = [
  'AvoidUnnecessaryBeforeUnloadCheckSync', 'BoundaryEventDispatchTracksNodeRemoval', 'DestroyProfileOnBrowserClose', 'DialMediaRouteProvider',
  'GlobalMediaControls', 'HttpsUpgrades', 'LensOverlay', 'MediaRouter', 'PaintHolding', 'ThirdPartyStoragePartitioning', 'Translate', 'AutoDeElevate',
  'RenderDocument', 'OptimizationHints', 'WebUIOmniboxPopup', 'WebUIOmniboxAimPopup',
];
const kArguments = [
  '--no-sandbox', '--disable-gpu', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
  '--disable-background-networking', '--disable-component-update', '--disable-sync', `--disable-features=${kOff.join()}`,
];
// In software each of several samples a pixel is drawn. Pictures of tests are as people see the page.
const argumentsOf = (more, antialias) => kArguments.concat(antialias || process.env.PAGE_PICTURES ? [] : '--webgl-antialiasing-mode=none', more);
const kLaunch = { executablePath: process.env.CHROMIUM, headless: true };

const contextOf = ({ width = 1280, height = 800, theme = 'dark', reducedMotion = null }) => ({
  viewport: { width, height }, colorScheme: theme, reducedMotion, hasTouch: width < 760, isMobile: width < 760,
});

// A Chromium of its own, with one page; `more` are arguments of it; `antialias` is for pictures that people look at.
export async function openBrowser({ more = [], antialias = false, ...looks } = {}) {
  const profile = mkdtempSync(join(tmpdir(), 'skein_page.'));
  const context = await chromium.launchPersistentContext(profile, { ...kLaunch, args: argumentsOf(more, antialias), ...contextOf(looks) });
  return watch(context, context.pages()[0], () => rmSync(profile, { recursive: true, force: true }));
}

// One Chromium for many: `open` is a page in a profile of its own, as openBrowser's, in a tenth of the time.
export async function startChromium({ more = [] } = {}) {
  const browser = await chromium.launch({ ...kLaunch, args: argumentsOf(more, false) });
  return {
    open: async (looks = {}) => {
      const context = await browser.newContext(contextOf(looks));
      return watch(context, await context.newPage(), () => {});
    },
    close: () => browser.close(),
  };
}

function watch(context, page, afterClose) {
  context.setDefaultTimeout(kPatienceMs); // also of pages that a case opens beside it
  const faults = [];
  const hosts = new Set();
  page.on('request', (r) => {
    if (!/^(data|blob):/.test(r.url())) hosts.add(new URL(r.url()).host);
  });
  page.on('websocket', (s) => hosts.add(new URL(s.url()).host));
  page.on('pageerror', (e) => faults.push(`error: ${e.message}`));
  page.on('dialog', (d) => {
    faults.push(`dialog: ${d.message()}`);
    d.dismiss();
  });
  page.on('console', (m) => {
    // A refused connection or a 404 is the server's; the page has to cope, and the tests look whether it does.
    if (m.type() === 'error' && !/Failed to load resource|WebSocket connection/.test(m.text())) faults.push(`console: ${m.text()}`);
  });
  return {
    page,
    faults,
    hosts,
    state: () => page.evaluate(() => window.skein.state()),
    // Polls the page's state until `holds` says so of it.
    until: async (what, holds, deadlineS = 120) => {
      const end = Date.now() + deadlineS * 1000;
      let state = null;
      while (Date.now() < end) {
        state = await page.evaluate(() => window.skein?.state()).catch(() => null);
        if (state && holds(state)) return state;
        await new Promise((r) => setTimeout(r, 100));
      }
      return assert.fail(`not within ${deadlineS} s: ${what}; the page: ${JSON.stringify({ ...state, cameras: state?.cameras?.length })}`);
    },
    // The view has come to rest: nothing is to be drawn or worked out, nor was anything drawn since the look before.
    rest: async (deadlineS = 120) => {
      const end = Date.now() + deadlineS * 1000;
      for (let last = -1, state = null; !state?.atRest || last !== state.framesDrawn; ) {
        assert.ok(Date.now() < end, `the page draws without end: ${last} frames`);
        last = state?.framesDrawn ?? -1;
        await page.waitForTimeout(50);
        state = await page.evaluate(() => window.skein.state());
      }
    },
    close: async () => {
      await context.close();
      afterClose();
    },
  };
}

// Ends a test of one page.
export function expectClean({ faults, hosts }, url) {
  assert.deepEqual(faults, []);
  assert.deepEqual([...hosts], [new URL(url).host]);
}

// The lowest contrast of the text that is seen with what lies behind it, of each kind of element, where it is below AA;
// once colours that are changing have changed.
export function contrastFaults(page) {
  return page.evaluate(async () => {
    const transitions = document.getAnimations().filter((a) => a instanceof CSSTransition);
    await Promise.allSettled(transitions.map((a) => a.finished));
    const parse = (c) => {
      const v = c.match(/[\d.]+/g).map(Number);
      return c.startsWith('color(srgb') ? [v[0] * 255, v[1] * 255, v[2] * 255, v[3] ?? 1] : [v[0], v[1], v[2], v[3] ?? 1];
    };
    const over = (a, b) => [0, 1, 2].map((k) => a[k] * a[3] + b[k] * (1 - a[3])).concat(1);
    const light = (c) => {
      const [r, g, b] = c.slice(0, 3).map((v) => (v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const faults = {};
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
      const element = node.parentElement;
      if (!node.data.trim() || !element.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
      if (element.closest('.unseen, .skip, [disabled], option, noscript')) continue;
      const layers = [];
      for (let e = element; e; e = e.parentElement) layers.push(parse(getComputedStyle(e).backgroundColor));
      const behind = layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255, 1]);
      const style = getComputedStyle(element);
      const [a, b] = [light(over(parse(style.color), behind)), light(behind)].sort((x, y) => y - x);
      const ratio = (a + 0.05) / (b + 0.05);
      const size = parseFloat(style.fontSize);
      const needed = size >= 24 || (size >= 18.6 && style.fontWeight >= 700) ? 3 : 4.5;
      if (ratio < needed) faults[`${element.tagName} ${element.className} in #${element.closest('[id]')?.id}`] = ratio.toFixed(2);
    }
    return faults;
  });
}
