// The card of the photo that was placed last.
import { photoName } from '../fold.js';
import { thumbnailUrl } from '../photo_urls.js';
import { seconds } from '../words.js';
import { byId, h, setText } from './dom.js';

export class Newest {
  constructor({ lookAt }) {
    this.element = byId('newest');
    this.element.addEventListener('click', lookAt);
    this.shown = 0;
    this.text = h('span');
  }

  // photo: of the state that is shown; undefined: none is placed
  update(photo) {
    this.element.hidden = !photo;
    if (!photo) {
      this.shown = 0;
      return;
    }
    if (this.shown !== photo.id) {
      const picture = h('img', { src: thumbnailUrl(photo), alt: '', width: 88, height: 66 });
      this.element.replaceChildren(picture, h('span', { className: 'text' }, h('small', {}, 'Newest'), h('b', {}, photoName(photo.agent, photo.name)), this.text));
    }
    this.shown = photo.id;
    setText(this.text, `placed after ${seconds((photo.firstPlaced - photo.received) / 1e6)}`);
  }
}
