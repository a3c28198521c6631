// Photos that are not placed: what is wrong with each and what would help; trying them again; dismissing them.
import { notPlacedOf, photoName } from '../fold.js';
import { thumbnailUrl } from '../photo_urls.js';
import { explain, groups, linkWords, plural, retryWords } from '../words.js';
import { h, keyed, setText } from './dom.js';
import { askToFinish } from './finish.js';

const kShown = 200;

export class Unplaced {
  // dismiss(key, on)
  constructor({ select, dismissed, dismiss }) {
    Object.assign(this, { select, dismissed, dismiss });
    this.open = new PhotoList((entry) => this.makeRow(entry, 'Dismiss', true));
    this.known = new PhotoList((entry) => this.makeRow(entry, 'Bring back', false));
    this.none = h('p', { className: 'muted' });
    this.retry = h('button', { type: 'button', className: 'plain', onclick: () => this.tryAgain() }, 'Try all again');
    this.retryWords = h('p', { className: 'muted', role: 'status' });
    this.retryPart = h('div', { className: 'retry_part' }, this.retryWords, this.retry);
    this.knownTitle = h('summary');
    this.knownPart = h('details', { className: 'dismissed_part' }, this.knownTitle,
      h('p', { className: 'muted' }, 'They count no more on the pages of this browser. Others see them as before.'), this.known.element);
    this.element = h('div', {},
      h('section', {}, h('h2', {}, 'Not placed'), this.none, this.retryPart, this.open.element), this.knownPart);
    this.told = '';
  }

  update(view) {
    const { state } = view;
    const all = notPlacedOf(state, view.diagnoses);
    const open = all.filter(({ key }) => !this.dismissed.has(key));
    const known = all.filter(({ key }) => this.dismissed.has(key));
    setText(this.none, state.photos.size === 0 ? 'No photos yet.' : all.length === 0 ? 'Every photo that was tried has its place.' : 'All of them are dismissed.');
    this.none.hidden = open.length > 0;
    this.updateRetry(view, open);
    this.open.update(open, state);
    this.knownPart.hidden = known.length === 0;
    setText(this.knownTitle, `Dismissed: ${plural(known.length, 'photo')}`);
    this.known.update(known, state);
  }

  updateRetry({ state, timeline, session }, open) {
    this.retryPart.hidden = open.length === 0 || !timeline.isLive || session.live === false;
    if (this.retryPart.hidden) return;
    const triable = open.filter(({ photo, standing }) => photo && standing.standing === 'unplaced' && photo.keypoints !== 0).length;
    const { words, can } = retryWords(state, triable, session.finishes);
    if (!can) this.told = '';
    this.retry.hidden = !can;
    this.retry.disabled = this.isAsking;
    setText(this.retryWords, this.told || words);
  }

  async tryAgain() {
    this.isAsking = this.retry.disabled = true;
    this.told = 'Asking\u2026';
    setText(this.retryWords, this.told);
    try {
      await askToFinish(0);
      this.told = 'Asked: they are tried again.';
    } catch (error) {
      this.told = `They are not tried: ${error.message}.`;
    }
    setText(this.retryWords, this.told);
    this.isAsking = this.retry.disabled = false;
  }

  makeRow({ key, photo, refused }, label, on) {
    const { agent, name } = photo ?? refused;
    const text = h('span', { className: 'text' }, h('b'), h('span', { className: 'what' }), h('span', { className: 'help' }), h('small'));
    const what = photo
      ? h('button', { type: 'button', className: 'shown', onclick: () => this.select(photo.id) }, pictureOf(photo), text)
      : h('div', { className: 'shown' }, noPicture(), text);
    return h('li', {}, what, h('button', {
      type: 'button', className: 'plain', 'aria-label': `${label}: ${photoName(agent, name)}`, onclick: () => this.dismiss(key, on),
    }, label));
  }
}

const noPicture = () => h('span', { className: 'no_picture', 'aria-hidden': 'true' }, 'no picture');
// What no service can decode has no thumbnail either.
const pictureOf = (photo) => h('img', {
  src: thumbnailUrl(photo), alt: '', loading: 'lazy', decoding: 'async', width: 96, height: 72, onerror: (e) => e.target.replaceWith(noPicture()),
});

class PhotoList {
  constructor(make) {
    this.make = make;
    this.list = h('ul', { className: 'unplaced_list' });
    this.more = h('p', { className: 'muted' });
    this.element = h('div', {}, this.list, this.more);
  }

  update(entries, state) {
    setText(this.more, `And ${groups(entries.length - kShown)} more.`);
    this.more.hidden = entries.length <= kShown;
    keyed(this.list, entries.slice(0, kShown), (entry) => entry.key, this.make, (row, { photo, refused, standing }) => {
      const { what, help } = explain(standing);
      const [text] = row.getElementsByClassName('text');
      const [name, whatLine, helpLine, link] = text.children;
      setText(name, photo ? photoName(photo.agent, photo.name) : photoName(refused.agent, refused.name));
      setText(whatLine, what);
      setText(helpLine, help);
      setText(link, photo && standing.standing === 'unplaced' ? linkWords(state, photo.id) : '');
      text.title = standing.reason;
    });
  }
}
