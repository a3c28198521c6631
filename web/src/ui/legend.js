// The colours of confidence and what they mean, over the picture while they are switched on.
import { confidenceColour } from '../colours.js';
import { h, setText, svg } from './dom.js';

const kSteps = 24; // of the colour bar
const kMeaning = 'Red is uncertain: the predicted standard error of a point’s depth is 1 % of its distance from its photo, or more. Green is sure: near 0 %.';
const kNoSurface = 'Only the surface has it: show the surface.';

export class Legend {
  constructor(element) {
    this.element = element;
    this.note = h('small', {});
    element.title = kMeaning;
    element.append(
      h('b', {}, 'Confidence'), colourBar(),
      h('div', { className: 'ends' }, h('span', {}, 'uncertain, ±1 % of distance'), h('span', {}, 'sure')), this.note);
  }

  update({ on, hasColours }) {
    this.element.hidden = !on;
    this.note.hidden = hasColours;
    setText(this.note, hasColours ? '' : kNoSurface);
  }
}

function colourBar() {
  const colourAt = (i) => `rgb(${confidenceColour(i / (kSteps - 1)).map((v) => Math.round(255 * v)).join(' ')})`;
  const bars = Array.from({ length: kSteps }, (_, i) => svg('rect', { x: i, width: 1.05, height: 1, fill: colourAt(i) }));
  return svg('svg', { viewBox: `0 0 ${kSteps} 1`, preserveAspectRatio: 'none', role: 'img', 'aria-label': kMeaning }, bars);
}
