// What the page says, in plain words. Pure functions.
import { bestLink, liveSubmaps, photoName } from './fold.js';
import { median } from './median.js';

const percent = (share) => `${Math.round(100 * share)} %`;
const nearer = (other, otherwise) => (other ? `Take another one nearer to where ${other} was taken.` : otherwise);

// Meaning of each cause at the site, and what would help, for the live view and the phone. libs/state/session/diagnosis.cc has
// the sentences of skein agent and report.json. The names are those of that file and of libs/state/session/state_names.cc.
// A function takes the figures of libs/view/web/diagnosis_json.h; standingOf() tells few of them.
const kCauses = {
  'too dark': ({ brightness }) => [`Too dark: mean grey level ${percent(brightness)}.`,
    'Is the lens covered? If not, expose longer or bring light, and take it again.'],
  'too bright': ({ brightness }) => [`Too bright: mean grey level ${percent(brightness)}.`, 'Expose shorter, and take it again.'],
  blurred: ({ blur }) => [`Blurred: ${percent(blur)}, where sharp photos have 20 %.`, 'Hold the camera still, wait for its focus, and take it again.'],
  'few details': ({ keypoints, coverage }) => [
    keypoints > 0 ? `Few details: ${plural(keypoints, 'keypoint')}, on ${percent(coverage)} of the photo.`
      : 'Nothing to recognise in this photo: it is blurred, dark or shows a plain surface.',
    'Take it again, sharp, with something textured in view.'],
  'no overlap': () => ['No other photo shows the same place yet.',
    'Take photos between here and the map. Each should share about half of its view with the one before.'],
  'weak overlap': ({ inliers, needed, other }) => [
    inliers < needed ? `${inliers} of ${needed} common points with ${other}.` : 'What it shows has too little in common with what is mapped so far.',
    other ? `Take another one halfway towards where ${other} was taken.` : 'Take more photos of this part from nearby, so that the map grows up to it.'],
  'rotation only': ({ other }) => ['Taken from the same spot as all photos that overlap it.',
    `Take a step sideways, a tenth of the distance to what ${other || 'it'} shows, and take another one.`],
  'flat surface only': () => ['It and what overlaps it show one flat surface alone.', 'Take it again with something in view that stands out of the surface.'],
  'similar place': () => ['It could be of one of several places that look alike.',
    'Take photos on the way from a place that is clearly told apart: doors, signs, corners.'],
  contradicted: ({ other }) => ['Its matches lead to different positions.', nearer(other, 'It is tried again. More photos between its neighbours help.')],
  camera: () => ['Its lens could not be told: zoom or size do not fit.', 'Keep the zoom, and send photos as the camera stored them, not cropped.'],
  'no initial pair': ({ other }) => [`No map could begin with it${other ? ` and ${other}` : ''}, although they show the same place.`,
    'Take two more, each a few steps further to the side, without zoom.'],
  'not in time': () => ['The finish ended before its turn came.', 'Finish again with more time.'],
  other: ({ reason }) => [sentence(reason) || kNoReason, 'Nothing to do: it is tried again.'],
  failed: ({ reason }) => [sentence(reason) || kNoReason, 'Take it again, or send it again as a JPEG.'],
  unreadable: () => ['It is damaged, or no photo that can be read.', 'Send it again as JPEG, PNG or TIFF.'],
  'phone format': () => ['Its format is HEIC or AVIF. This session takes JPEG, PNG and TIFF.',
    'iPhone: Settings > Camera > Formats > Most Compatible; when sharing, Options > Most Compatible. Android: switch off HEIF, or “high efficiency”, in the camera’s settings.'],
  'too small': () => ['It is too small.', 'Send photos in their full size.'],
  'too large': () => ['It is larger than this session takes.', 'Send it smaller, or raise the limit of the ingest service.'],
  altered: () => ['Twice it arrived with other bytes than this phone had read.', 'Choose it again, or take it again.'],
  vanished: () => ['The connection was lost while it was being sent.', 'Start the agent again: it sends what is missing.'],
};
const kNoReason = 'No reason was given.';

// {what, help}: sentences for a photo that is not placed. told: {cause, reason, figures} of a diagnosis, or of standingOf().
export function explain(told) {
  const known = Object.hasOwn(kCauses, told.cause) ? kCauses[told.cause] : kCauses.failed;
  const [what, help] = known(told);
  return { what, help };
}

export const sentence = (text) => (text ? text[0].toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? '' : '.') : '');

export const plural = (n, one, many = one + 's') => `${groups(n)} ${n === 1 ? one : many}`;

// 12 345: thin spaces between groups of three.
export function groups(n) {
  return String(Math.round(n)).replace(/\B(?=(\d{3})+(?!\d))/g, '\u202f');
}

export function seconds(s) {
  if (s === null || s === undefined || !Number.isFinite(s)) return '–';
  if (s < 0.0995) return `${Math.round(s * 1000)} ms`;
  if (s < 9.95) return `${s.toFixed(1)} s`;
  if (s < 99.5) return `${Math.round(s)} s`;
  if (s < 5970) return `${Math.round(s / 60)} min`;
  return `${(s / 3600).toFixed(1)} h`;
}

export function bytes(n) {
  if (!Number.isFinite(n)) return '–';
  if (n < 1e3) return `${n} B`;
  if (n < 999.5e3) return `${Math.round(n / 1e3)} kB`;
  if (n < 1e9) return `${(n / 1e6).toFixed(1)} MB`;
  return `${(n / 1e9).toFixed(1)} GB`;
}

// A length in three digits.
export function length(value, inMetres) {
  if (!Number.isFinite(value)) return '–';
  if (!inMetres) return `${Number(value.toPrecision(3))} ${Number(value.toPrecision(3)) === 1 ? 'unit' : 'units'}`;
  if (value < 0.01) return `${Number((value * 1000).toPrecision(2))} mm`;
  if (value < 1) return `${Number((value * 100).toPrecision(3))} cm`;
  if (value < 1000) return `${Number(value.toPrecision(3))} m`;
  return `${Number((value / 1000).toPrecision(3))} km`;
}

// In three digits.
const three = (value) => (value < 1000 ? String(Number(value.toPrecision(3))) : groups(Number(value.toPrecision(3))));

export function area(value, inMetres) {
  if (!inMetres) return `${three(value)} square units`;
  return value > 0 && value < 0.01 ? `${three(value * 1e4)} cm²` : `${three(value)} m²`;
}

export function volume(value, inMetres) {
  if (!inMetres) return `${three(value)} cubic units`;
  return value > 0 && value < 0.001 ? `${three(value * 1e6)} cm³` : `${three(value)} m³`;
}

// Of a difference of heights: from the first point to the second one.
export const height = (value, inMetres) => `${value < 0 ? '−' : '+'}${length(Math.abs(value), inMetres)}`;

const kNoVolume = { points: 'no volume: too few points inside', steep: 'no volume: the base is steeper than 45°' };

// Of measureHeap(), line by line. scale: {factor: from its unit, inMetres, source: who tells that}
export function heapWords(heap, { factor, inMetres, source }, isSparse) {
  const told = (v) => volume(v * factor ** 3, inMetres);
  const points = plural(heap.numPoints, isSparse ? 'sparse point' : 'point');
  return [
    `${area(heap.area * factor ** 2, inMetres)}${source}`,
    heap.why ? kNoVolume[heap.why] : `${told(heap.above)} above its base, ${told(heap.below)} below`,
    heap.empty > 0 && `${Math.ceil(100 * heap.empty)} % of the area has no points`,
    heap.why ? points : `${points}, cells of ${length(heap.cell * factor, inMetres)}`,
  ].filter(Boolean);
}

// [[name, value]] of coordinatesOf() of a point. nameOf(image): of the photo that metres are counted from.
export function coordinateWords(at, nameOf) {
  const metres = (v) => `${v.toFixed(at.error < 0.1 ? 2 : 1)}\u00a0m`;
  const along = (v, positive, negative) => `${metres(Math.abs(v))} ${v < 0 ? negative : positive}`;
  const parts = [along(at.east, 'east', 'west'), along(at.north, 'north', 'south'), ...(at.up === null ? [] : [along(at.up, 'up', 'down')])];
  return [
    ['Degrees', degrees(at)],
    ...(at.altitude === null ? [] : [['Altitude', `${metres(at.altitude)} by the photos’ GPS`]]),
    ['Metres', `${parts.join(', ')} from ${nameOf(at.from)}`],
    ['Accuracy', `${length(at.error, true)} between the photos’ GPS and the map; more away from them`],
  ];
}

// Latitude and longitude, to 1 cm where that means something.
export function degrees({ latitude, longitude, error }) {
  const digits = error < 0.1 ? 7 : 6;
  return `${latitude.toFixed(digits)}, ${longitude.toFixed(digits)}`;
}

export function clock(utime) {
  return new Date(utime / 1000).toLocaleTimeString([], { hour: '2-digit', minute: '2-digit', second: '2-digit' });
}

export function ago(s) {
  if (s < 1.5) return 'just now';
  return `${s < 99.5 ? `${Math.round(s)} s` : seconds(s)} ago`;
}

// States of a finish in their order, as FinishStateName of libs/state/session/state_names.h; a finish without divided places has
// no batch. {now: on the button, sentence: of the header}
const kFinishSteps = {
  requested: { now: 'The last photos are being matched.', sentence: 'Finishing: the last photos are being matched.' },
  drained: { now: 'The maps are put in order and joined.', sentence: 'Finishing: the maps are put in order and joined where they overlap.' },
  batch: {
    now: 'A place with several maps is mapped once more, by all its photos at once.',
    sentence: 'Finishing: a place with several maps is mapped once more, by all its photos at once.',
  },
  settled: { now: 'The final adjustment.', sentence: 'Finishing: the final adjustment of all cameras and points.' },
  done: { now: 'Finished. Photos that come later are taken in, too: finish again after them.', sentence: '' },
};
const kStepNames = Object.keys(kFinishSteps);
export const kLastFinishStep = kStepNames.length - 1;

// {isRunning, step: null where a later version names a state that this page does not know, words}. finish: of the state, or null;
// utimeNow: null where it is not the present.
export function finishProgress(finish, utimeNow = null) {
  if (!finish) return { isRunning: false, step: null, words: 'All maps are adjusted and joined once more, checked and written. A time gives the best that there is by then.' };
  const isRunning = finish.state !== 'done';
  const at = kStepNames.indexOf(finish.state);
  return { isRunning, step: at < 0 ? null : at, words: (kFinishSteps[finish.state]?.now ?? 'It is being finished.') + deadlineWords(finish, isRunning, utimeNow) };
}

function deadlineWords({ cut, deadline }, isRunning, utimeNow) {
  if (!isRunning) return cut ? ' Its time was up: what was left is left out, and told in the report.' : '';
  if (cut) return ' Its time is up: the maps are written as they are.';
  if (!deadline || utimeNow === null) return '';
  return ` Its time is up in ${seconds(Math.max(1, Math.round((deadline - utimeNow) / 1e6)))}: what is not done by then is left out.`;
}

export const kMostFinishMinutes = 1440;

// Seconds of the field for minutes; 0: as long as it takes. null: not a time that a finish takes.
export function finishSeconds(text) {
  if (text.trim() === '') return 0;
  const minutes = Number(text.replace(',', '.'));
  return minutes > 0 && minutes <= kMostFinishMinutes ? Math.max(1, Math.round(minutes * 60)) : null;
}

function finishingSentence(finish) {
  if (!finish || finish.state === 'done') return '';
  return kFinishSteps[finish.state]?.sentence ?? 'Finishing.';
}

// In a sentence or two what happens ('live'), happened ('past', of a replay), or what a stored session ended with ('stored').
// `summary` of summarize().
export function whatHappens(state, summary, when) {
  const { counts, needOthers } = summary;
  const working = counts.waiting - needOthers;
  if (when === 'stored') return howItEnded(state, summary, working);
  const open = [...state.merges.values()].find((m) => m.state === 'ordered' || m.state === 'frozen');
  const finishing = finishingSentence(state.finish);
  if (counts.received === 0) return 'Waiting for the first photo.';
  if (finishing) return finishing;
  if (open) return `Map ${open.source} is being joined to map ${open.target}.`;
  if (working > 0) {
    const pace = medianGap(summary.latencies);
    const about = when === 'live' && pace ? `, about ${seconds(pace)} a photo` : '';
    return `Placing photos: ${groups(working)} waiting${about}.`;
  }
  if (numMaps(state) === 0) return 'No map yet: two photos that overlap well are needed to begin one.';
  const maps = mapsWords(state, summary);
  if (hasFinished(state)) return `Finished. ${maps}`;
  if (numMaps(state) > 1) return `${maps} Photos that show parts of two maps join them.`;
  return when === 'live' ? `${maps} Ready for more.` : maps;
}

// Nothing goes on any more, whatever the last facts are.
function howItEnded(state, summary, working) {
  if (summary.counts.received === 0) return 'No photo was sent.';
  const left = working === 0 ? '' : ` ${plural(working, 'photo')} had not been tried when it ended.`;
  if (numMaps(state) === 0) return `No map: two photos that overlap well are needed to begin one.${left}`;
  const isCutOff = finishingSentence(state.finish) !== '';
  const how = hasFinished(state) ? 'Finished. ' : isCutOff ? 'It ended before its finish was done. ' : '';
  return how + mapsWords(state, summary, working > 0) + left;
}

const numMaps = (state) => liveSubmaps(state).filter((s) => s.numRegistered > 0).length;
const hasFinished = ({ finish, photos }) => finish?.state === 'done' && lastPhotoBefore({ photos }, finish.utime);

function mapsWords(state, { notPlaced, needOthers, dismissed = 0 }, isMoreLeft = false) {
  const maps = numMaps(state) === 1 ? 'One map' : `${numMaps(state)} separate maps`;
  const alone = needOthers === 0 ? '' : ` ${plural(needOthers, 'photo waits', 'photos wait')} for others that overlap ${needOthers === 1 ? 'it' : 'them'}.`;
  if (notPlaced > 0) return `${maps}. ${notPlacedWords(notPlaced, dismissed)}${alone}`;
  return alone || isMoreLeft ? `${maps}.${alone}` : `${maps}, every photo placed.`;
}

// notPlaced: those that were dismissed among them.
export function notPlacedWords(notPlaced, dismissed) {
  const open = notPlaced - dismissed;
  if (dismissed === 0) return `${plural(open, 'photo')} not placed.`;
  return open === 0 ? `${plural(dismissed, 'photo')} not placed, and dismissed.` : `${plural(open, 'photo')} not placed, and ${groups(dismissed)} dismissed.`;
}

// Of photos that are not placed, {words, can}: how they are tried again, and whether a finish would try them with more than
// was known before. triable: how many of them are no failures.
export function retryWords(state, triable, mayFinish) {
  const { finish } = state;
  if (triable === 0) return { words: 'None of these can be tried again as it is: each says what would help.', can: false };
  if (finish && finish.state !== 'done') return { words: 'A finish is under way: it tries each of them once more.', can: false };
  if (finish && !finish.cut && lastPhotoBefore(state, finish.utime)) {
    return { words: `The finish of ${clock(finish.utime)} tried them against the whole map. No photo has come since, so another try would find the same.`, can: false };
  }
  const byItself = 'A photo is tried again by itself when one that shows the same place is placed.';
  if (!mayFinish) return { words: byItself, can: false };
  return { words: `${byItself} Trying all again is a finish: seconds to some minutes, and the session goes on.`, can: true };
}

// Where a phone's browser cannot keep what it should: what that is, and what to do. name: of the error.
export function storageWords(name) {
  return name === 'QuotaExceededError'
    ? 'This phone’s storage is full. Photos that wait here are sent all the same: free some space, and leave this page open until they are.'
    : `This browser’s storage fails (${name}). Reload this page: what was kept before is still there.`;
}

function lastPhotoBefore(state, utime) {
  for (const photo of state.photos.values()) if (photo.stored > utime) return false;
  return true;
}

// Median of the seconds between the last twenty placements.
export function medianGap(latencies) {
  const last = latencies.slice(-21);
  const gaps = last.slice(1).map((l, i) => (l.t - last[i].t) / 1e6);
  return gaps.length < 3 ? null : median(gaps);
}

export function mergeWords(merge) {
  const pair = `map ${merge.source} to map ${merge.target}`;
  switch (merge.state) {
    case 'ordered':
      return `Joining ${pair}`;
    case 'frozen':
      return `Joining ${pair}: comparing`;
    case 'done':
      return `Joined ${pair}`;
    case 'undone':
      return `Not joined, ${pair}: ${merge.reason || 'no reason was given'}`;
    default:
      return `No common shape of ${pair}: ${merge.reason || 'too little in common'}`;
  }
}

export function linkWords(state, imageId) {
  const best = bestLink(state, imageId);
  if (!best) return '';
  const other = state.photos.get(best.image);
  const name = other ? photoName(other.agent, other.name) : `photo ${best.image}`;
  return `Best match: ${name}, ${plural(best.inliers, 'common point')}.`;
}

export function submapWords(submap, isOpenSource) {
  if (submap.ended) return submap.mergedInto ? `joined map ${submap.mergedInto}` : submap.reason || 'ended';
  if (submap.openMerge) return isOpenSource ? 'joining another map' : 'taking in another map';
  if (submap.numRegistered === 0) return 'beginning';
  return submap.state === 'final' ? 'final' : 'growing';
}
