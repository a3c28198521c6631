// The dialog with keys and what is seen.
import { byId, h, iconButton } from './dom.js';

const kKeys = [
  ['Drag', 'turn'], ['Right or shift drag, two fingers', 'move'], ['Wheel, pinch, + −', 'zoom'], ['Double click', 'look at that'],
  ['Arrow keys', 'turn'], ['W A S D, Q E', 'move, up and down; with shift faster'], ['F', 'show everything'], ['N', 'follow the newest photo'],
  ['V', 'fly'], ['M', 'measure a distance or an area'], ['P', 'points, surface or mesh'], ['Space', 'replay or pause'], ['Esc', 'deselect'], ['?', 'this help'],
];
const kNotes = [
  'Each pyramid is a photo where it was taken; its colour is its agent’s. Maps that do not overlap yet stand side by side, each with a scale of its own, until photos join them.',
  'The surface is made of the photos’ depth maps, while photos come. It needs the process skein-dense. In a replay a photo’s part is there once that photo is placed. The mesh joins all depth maps of a map as triangles while no photo waits; in a replay points are in its place.',
  'Measuring an area: press Area, pick its corners one after another, then Close or the first corner. Its volume is told above and below a base, the plane that fits the points at its border best. Show the surface first: points alone are sparse.',
  'Profile, once a distance is measured: heights of the points along that line. The curve is their median, the band goes from the lowest to the highest. A section, among what is shown, hides points outside a box; what it hides is not measured.',
  'In a replay a point appears once two placed cameras have it in view: an estimate, as nothing tells when it came.',
];

export function showHelp(version) {
  const dialog = byId('dialog');
  dialog.className = 'narrow';
  dialog.replaceChildren(
    h('div', { className: 'head_row' }, h('h2', { id: 'dialog_title' }, 'Keys and help'), iconButton('close', 'Close', () => dialog.close())),
    h('dl', { className: 'keys' }, kKeys.map(([k, what]) => h('div', {}, h('dt', {}, k), h('dd', {}, what)))),
    ...kNotes.map((note) => h('p', { className: 'muted' }, note)),
    h('p', { className: 'muted' }, `Skein ${version}`));
  dialog.showModal();
}
