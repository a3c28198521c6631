// Finishing the session from the page, for an operator: in a given time or as long as it takes, and how far it is.
import { finishProgress, kLastFinishStep, seconds } from '../words.js';
import { h, setText } from './dom.js';

const kTimes = [[0, 'as long as it takes'], [30, 'within 30 seconds'], [120, 'within 2 minutes'], [600, 'within 10 minutes']];

// Throws with the reason where it does not begin.
export async function askToFinish(within) {
  const answer = await fetch('/api/finish', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ within_s: within }) });
  if (!answer.ok) throw new Error((await answer.json()).error);
}

export class Finish {
  constructor() {
    this.within = h('select', { 'aria-label': 'Time for the finish' }, kTimes.map(([s, label]) => h('option', { value: s }, label)));
    this.button = h('button', { type: 'button', className: 'download', onclick: () => this.ask() }, 'Finish');
    this.progress = h('progress', { max: kLastFinishStep, hidden: true, 'aria-label': 'Steps of the finish' });
    this.words = h('p', { className: 'muted', role: 'status' });
    this.element = h('section', { className: 'finish_part', hidden: true }, h('h2', {}, 'Finish'),
      h('div', { className: 'finish_row' }, this.button, this.within), this.progress, this.words);
    this.told = '';
  }

  update({ session, state, summary }) {
    this.element.hidden = !session.finishes || summary.counts.received === 0;
    const { isRunning, step, words } = finishProgress(state.finish);
    this.button.disabled = isRunning || this.isAsking;
    this.progress.hidden = !isRunning;
    if (step === null) this.progress.removeAttribute('value');
    else this.progress.value = step;
    if (isRunning) this.told = '';
    setText(this.words, this.told || words);
  }

  async ask() {
    const within = Number(this.within.value);
    this.isAsking = this.button.disabled = true;
    this.told = within ? `Asking for a finish within ${seconds(within)}\u2026` : 'Asking\u2026';
    setText(this.words, this.told);
    try {
      await askToFinish(within);
      this.told = '';
    } catch (error) {
      this.told = `It does not begin: ${error.message}.`;
      setText(this.words, this.told);
    }
    this.isAsking = this.button.disabled = false;
  }
}
