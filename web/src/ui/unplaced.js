// Photos that are not placed: what is wrong with each and what would help.
import { photoName, standingOf } from '../fold.js';
import { thumbnailUrl } from '../photo_urls.js';
import { advise, groups, linkWords } from '../words.js';
import { h, keyed, setText } from './dom.js';

const kShown = 200;

export class Unplaced {
  constructor({ select }) {
    this.select = select;
    this.list = h('ul', { className: 'unplaced_list' });
    this.none = h('p', { className: 'muted' });
    this.more = h('p', { className: 'muted' });
    this.element = h('div', {}, h('section', {}, h('h2', {}, 'Not placed'), this.none, this.list, this.more));
  }

  update(view) {
    const { state } = view;
    const diagnoses = new Map(view.timeline.isLive ? view.status?.diagnoses?.map((d) => [d.image, d]) : []);
    const photos = [];
    for (const photo of state.photos.values()) {
      const standing = standingOf(state, photo);
      if (standing.standing === 'unplaced' || standing.standing === 'failed') photos.push({ photo, standing, key: `p${photo.id}/${photo.stored}` });
    }
    photos.reverse();
    state.refused.forEach((r, i) => photos.push({ refused: r, standing: { standing: 'failed', reason: r.reason }, key: `r${i}/${r.agent}/${r.name}` }));
    setText(this.none, state.photos.size === 0 ? 'No photos yet.' : 'Every photo that was tried has its place.');
    this.none.hidden = photos.length > 0;
    const shown = photos.slice(0, kShown);
    setText(this.more, `And ${groups(photos.length - kShown)} more.`);
    this.more.hidden = photos.length <= kShown;
    keyed(this.list, shown, (p) => p.key, (p) => this.make(p), (row, { photo, refused, standing }) => {
      const { what, help } = advise(diagnoses.get(photo?.id), standing.reason);
      const [text] = row.getElementsByClassName('text');
      const [name, whatLine, helpLine, link] = text.children;
      setText(name, photo ? photoName(photo.agent, photo.name) : photoName(refused.agent, refused.name));
      setText(whatLine, what);
      setText(helpLine, help);
      setText(link, photo && standing.standing === 'unplaced' ? linkWords(state, photo.id) : '');
      text.title = standing.reason;
    });
  }

  make({ photo }) {
    const text = h('span', { className: 'text' }, h('b'), h('span', { className: 'what' }), h('span', { className: 'help' }), h('small'));
    if (!photo) return h('li', { className: 'refused' }, text);
    const picture = h('img', { src: thumbnailUrl(photo), alt: '', loading: 'lazy', decoding: 'async', width: 96, height: 72 });
    return h('li', {}, h('button', { type: 'button', onclick: () => this.select(photo.id) }, picture, text));
  }
}
