// Finishing the session from the page, for an operator: in a given time or as long as it takes, how far it is, and an earlier
// end of a finish that runs.
import { finishProgress, finishSeconds, kLastFinishStep, kMostFinishMinutes, seconds, sentence } from '../words.js';
import { h, setText } from './dom.js';

// Throws with the reason where it does not begin. On a finish that runs `within` is an earlier deadline, in seconds.
export async function askToFinish(within) {
  const answer = await fetch('/api/finish', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ within_s: within }) });
  if (!answer.ok) throw new Error((await answer.json()).error);
}

// '' where ingest does not tell what the finish waits for.
const stepOf = (state) => sentence(/^finishing[^:]*: (.+)/.exec(state)?.[1]);

export class Finish {
  constructor() {
    this.minutes = h('input', {
      type: 'text', inputmode: 'decimal', autocomplete: 'off', maxlength: 6, placeholder: 'any', 'aria-label': 'Minutes for the finish',
      oninput: () => this.showButton(), onkeydown: (e) => e.key === 'Enter' && !this.button.disabled && this.ask(),
    });
    this.button = h('button', { type: 'button', className: 'download', onclick: () => this.ask() }, 'Finish');
    this.progress = h('progress', { max: kLastFinishStep, hidden: true, 'aria-label': 'Steps of the finish' });
    this.words = h('p', { className: 'muted', role: 'status' });
    this.detail = h('p', { className: 'muted finish_detail' });
    this.element = h('section', { className: 'finish_part', hidden: true }, h('h2', {}, 'Finish'),
      h('div', { className: 'finish_row' }, this.button, h('label', {}, 'within', this.minutes, 'minutes')), this.progress, this.words, this.detail);
    this.told = '';
    this.isRunning = this.isCut = this.isAsking = false;
  }

  update({ session, state, summary, status, timeline, utimeNow }) {
    this.element.hidden = !session.finishes || summary.counts.received === 0;
    const isPresent = timeline.isLive && session.live !== false;
    const { isRunning, step, words } = finishProgress(state.finish, isPresent ? utimeNow : null);
    if (isRunning !== this.isRunning) this.told = this.minutes.value = '';
    this.isRunning = isRunning;
    this.isCut = isRunning && state.finish.cut;
    this.progress.hidden = !isRunning;
    if (step === null) this.progress.removeAttribute('value');
    else this.progress.value = step;
    this.showButton();
    setText(this.words, this.told || words);
    const ingest = isRunning && isPresent && status?.processes?.find((p) => p.instance === 'ingest');
    setText(this.detail, ingest ? stepOf(String(ingest.state)) : '');
  }

  // A finish that runs ends sooner by a time alone.
  showButton() {
    const within = finishSeconds(this.minutes.value);
    setText(this.button, this.isRunning ? 'Shorten' : 'Finish');
    this.button.disabled = this.isAsking || this.isCut || (this.isRunning && within === 0);
  }

  async ask() {
    const within = finishSeconds(this.minutes.value);
    if (within === null) return this.tell(`Give minutes, at most ${kMostFinishMinutes}, or nothing.`);
    const shortens = this.isRunning;
    this.isAsking = true;
    this.showButton();
    this.tell(within ? `Asking for ${shortens ? 'its end' : 'a finish'} within ${seconds(within)}\u2026` : 'Asking\u2026');
    try {
      await askToFinish(within);
      this.tell('');
    } catch (error) {
      this.tell(`It ${shortens ? 'is not shortened' : 'does not begin'}: ${error.message}.`);
    }
    this.isAsking = false;
    this.showButton();
  }

  tell(text) {
    this.told = text;
    setText(this.words, text);
  }
}
