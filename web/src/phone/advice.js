// The guide's first advice for this phone, as an arrow and words, and the photo to stand at.
import { setText } from '../ui/dom.js';
import { plural, sentence } from '../words.js';

const kStepM = 0.7;
const kNear = 0.06; // of the distance to the object: no way to go
const kArrows = ['↑', '↗', '→', '↘', '↓', '↙', '←', '↖'];
const kWays = ['forward', 'forward, to the right', 'to the right', 'back, to the right', 'back', 'back, to the left', 'to the left', 'forward, to the left'];

// {arrow, steps, text}; null where there is none. The arrow is of someone who stands where the photo that the advice names
// was taken, and faces what it shows.
export function adviceWords(advice) {
  const station = advice?.stations?.[0];
  if (!station?.sentence) return null;
  const [right, down, forward] = Array.isArray(station.offset) ? station.offset : [NaN, NaN, NaN];
  const level = Math.hypot(right, forward);
  const place = { text: sentence(station.sentence), from: Number.isFinite(station.nearest) ? station.nearest : 0 };
  if (!Number.isFinite(level + down)) return { ...place, arrow: '', steps: 'Next photo' };
  const steps = Math.round((level * (advice.metres_per_unit || 0)) / kStepM);
  const isNear = (offset) => offset < kNear * (advice.working_distance || 0);
  if (isNear(level)) return { ...place, arrow: '', steps: `Next photo, ${isNear(Math.abs(down)) ? 'from the same spot' : down < 0 ? 'higher' : 'lower'}` };
  const way = Math.round(Math.atan2(right, forward) / (Math.PI / 4) + 8) % 8;
  return { ...place, arrow: kArrows[way], steps: steps > 0 ? `${plural(steps, 'step')} ${kWays[way]}` : `Next photo, ${kWays[way]}` };
}

// words: of adviceWords(). line: <p><span>ARROW</span><span><b>STEPS</b><span>TEXT</span></span></p>
export function showAdvice(line, words) {
  line.hidden = !words;
  if (!words) return;
  const [arrow, told] = line.children;
  setText(arrow, words.arrow);
  setText(told.children[0], words.steps);
  setText(told.children[1], words.text);
}

// The photo that the advice starts from, as a faint picture over the camera's: who stands where it was taken sees both alike.
// It is kept once it is here, as the network may be gone by the time it is needed. A phone may have its own photos alone.
export class Ghost {
  // changed(): there is another one, or none
  constructor({ changed, fetch = globalThis.fetch.bind(globalThis), urls = globalThis.URL }) {
    Object.assign(this, { changed, fetch, urls });
    this.image = 0; // that is asked for; 0: none
    this.url = '';
  }

  async show(image) {
    if (image === this.image) return;
    this.image = image;
    this.set('');
    if (image === 0) return;
    try {
      const answer = await this.fetch(`/api/photos/${image}/thumbnail`);
      if (!answer.ok) return;
      const picture = await answer.blob();
      if (image === this.image) this.set(this.urls.createObjectURL(picture));
    } catch {
      if (image === this.image) this.image = -1; // no network: asked for again with the next advice
    }
  }

  set(url) {
    if (url === this.url) return;
    if (this.url) this.urls.revokeObjectURL(this.url);
    this.url = url;
    this.changed();
  }
}
