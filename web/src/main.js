import { App } from './app.js';
import { enter } from './enter.js';
import { byId, h } from './ui/dom.js';

const app = new App();
const refusal = await whyNotLetIn();
if (refusal) showDoor(refusal);
else app.start();

// '' on the session's own host, with an invitation that holds, and while the server is away.
async function whyNotLetIn() {
  try {
    const told = await enter();
    if (told) return told;
    const answer = await fetch('/api/session', { cache: 'no-store' });
    return answer.status === 401 || answer.status === 403 ? (await answer.json()).error : '';
  } catch {
    return '';
  }
}

function showDoor(why) {
  byId('empty').hidden = false;
  byId('empty').replaceChildren(h('h2', {}, 'Not let in'), h('p', { role: 'alert' }, `${why[0].toUpperCase()}${why.slice(1)}.`));
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
