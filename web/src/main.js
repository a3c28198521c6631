import { App } from './app.js';
import { storedTheme, systemTheme } from './choices.js';
import { doorOf, kConnecting } from './door.js';
import { enter } from './enter.js';
import { byId } from './ui/dom.js';
import { showDoor } from './ui/door.js';

const kPatienceMs = 8000;

const app = new App();
document.documentElement.dataset.theme = storedTheme() ?? systemTheme();
showDoor(byId('empty'), kConnecting, 'status');
const refusal = await whyNotLetIn();
document.body.classList.toggle('shut', refusal !== '');
if (refusal) showDoor(byId('empty'), doorOf(refusal));
else app.start();

// '' on the session's own host, with an invitation that holds, and while the server is away.
async function whyNotLetIn() {
  const ask = (path, options) => fetch(path, { ...options, signal: AbortSignal.timeout(kPatienceMs) });
  try {
    const told = await enter({ fetch: ask });
    if (told) return told;
    const answer = await ask('/api/session', { cache: 'no-store' });
    return answer.status === 401 || answer.status === 403 ? (await answer.json()).error : '';
  } catch {
    return '';
  }
}

addEventListener('hashchange', () => location.reload());

// For tests and the browser's console.
window.skein = {
  state: () => app.describe(),
  project: (image) => app.viewer.projectCamera(image),
  pickAt: (x, y) => app.viewer.pickAt(x, y),
  pixels: () => app.viewer.samplePixels(),
  select: (image) => app.select(image ? { image } : null),
  showTime: (utime) => app.showTime(utime),
};
