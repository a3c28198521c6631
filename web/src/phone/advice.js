// The guide's first advice for this phone, as an arrow and words.
import { plural, sentence } from '../words.js';

const kStepM = 0.7;
const kArrows = ['↑', '↗', '→', '↘', '↓', '↙', '←', '↖'];
const kWays = ['forward', 'forward, to the right', 'to the right', 'back, to the right', 'back', 'back, to the left', 'to the left', 'forward, to the left'];

// {arrow, steps, text}; null where there is none. The arrow is of someone who stands where the photo that the advice names
// was taken, and faces what it shows.
export function adviceWords(advice) {
  const station = advice?.stations?.[0];
  if (!station?.sentence) return null;
  const [right, down, forward] = Array.isArray(station.offset) ? station.offset : [NaN, NaN, NaN];
  const level = Math.hypot(right, forward);
  const place = { text: sentence(station.sentence) };
  if (!Number.isFinite(level + down)) return { ...place, arrow: '', steps: 'Next photo' };
  const steps = Math.round((level * (advice.metres_per_unit || 0)) / kStepM);
  if (level < 0.06 * (advice.working_distance || 0)) return { ...place, arrow: '', steps: 'Next photo from there' };
  const way = Math.round(Math.atan2(right, forward) / (Math.PI / 4) + 8) % 8;
  return { ...place, arrow: kArrows[way], steps: steps > 0 ? `${plural(steps, 'step')} ${kWays[way]}` : 'Next photo' };
}
