// Two photos side by side with their matched points joined by lines.
import { photoName } from '../fold.js';
import { uprightPoint, uprightSize } from '../orientation.js';
import { photoUrl } from '../photo_urls.js';
import { groups, plural } from '../words.js';
import { byId, h, iconButton, setText, svg } from './dom.js';

const kLinesAtFirst = 80;

export class Compare {
  constructor() {
    this.dialog = byId('dialog');
    this.dialog.addEventListener('click', (e) => {
      if (e.target === this.dialog) this.dialog.close();
    });
    this.dialog.addEventListener('close', () => {
      this.observer?.disconnect();
      this.dialog.replaceChildren();
    });
  }

  async show(a, b, inliers) {
    this.photos = [a, b];
    this.lines = svg('svg', { class: 'match_lines', 'aria-hidden': 'true' });
    this.pictures = [a, b].map((photo) => {
      const [width, height] = uprightSize(photo);
      return h('img', { src: photoUrl(photo), alt: `Photo ${photoName(photo.agent, photo.name)}`, width, height, onload: () => this.layOut() });
    });
    this.pair = h('div', { className: 'pair' },
      this.pictures.map((picture, i) => h('figure', {}, picture, h('figcaption', {}, photoName(this.photos[i].agent, this.photos[i].name)))), this.lines);
    this.note = h('p', { className: 'muted' }, 'Getting the matched points…');
    this.amount = h('input', { type: 'range', min: 1, max: 1, value: 1, oninput: () => this.layOut(), 'aria-label': 'Lines shown' });
    this.amountBox = h('label', { className: 'amount', hidden: true }, 'Lines', this.amount);
    this.dialog.className = '';
    this.dialog.replaceChildren(
      h('div', { className: 'head_row' }, h('h2', { id: 'dialog_title' }, `${plural(inliers, 'common point')}`), this.amountBox,
        iconButton('close', 'Close', () => this.dialog.close())),
      this.pair, this.note);
    if (!this.dialog.open) this.dialog.showModal();
    this.observer?.disconnect();
    this.observer = new ResizeObserver(() => this.layOut());
    this.observer.observe(this.pair);
    this.points = [];
    await this.load(a.id, b.id);
  }

  async load(a, b) {
    try {
      const answer = await fetch(`/api/photos/${a}/matches/${b}`);
      if (!answer.ok) throw new Error(String(answer.status));
      const { points } = await answer.json();
      if (this.photos[0].id !== a || this.photos[1].id !== b || !this.dialog.open) return;
      this.points = spread(points.filter((p) => Array.isArray(p) && p.length === 4 && p.every(Number.isFinite)));
      this.amount.max = this.points.length;
      this.amount.value = Math.min(kLinesAtFirst, this.points.length);
      this.amountBox.hidden = this.points.length < 10;
      this.layOut();
    } catch {
      setText(this.note, 'The matched points cannot be had now: the server does not have them, or the connection is lost.');
    }
  }

  layOut() {
    const box = this.pair.getBoundingClientRect();
    if (box.width === 0 || this.points.length === 0) return;
    const n = Math.min(Number(this.amount.value), this.points.length);
    setText(this.note, `Lines join ${groups(n)} of ${plural(this.points.length, 'point')}.`);
    this.lines.setAttribute('viewBox', `0 0 ${box.width} ${box.height}`);
    const boxes = this.pictures.map((p) => p.getBoundingClientRect());
    const at = (i, x, y) => {
      const { orientation, width, height } = this.photos[i];
      const [u, v] = uprightPoint(orientation, x / width, y / height);
      return [boxes[i].left - box.left + u * boxes[i].width, boxes[i].top - box.top + v * boxes[i].height, v];
    };
    const parts = this.points.slice(0, n).flatMap(([xa, ya, xb, yb]) => {
      const [x1, y1, v] = at(0, xa, ya);
      const [x2, y2] = at(1, xb, yb);
      const stroke = `hsl(${Math.round(20 + 300 * v)} 95% 60%)`;
      return [
        svg('line', { x1, y1, x2, y2, stroke, class: 'match_line' }),
        svg('circle', { cx: x1, cy: y1, r: 2.5, fill: stroke }), svg('circle', { cx: x2, cy: y2, r: 2.5, fill: stroke }),
      ];
    });
    this.lines.replaceChildren(...parts);
  }
}

// In an order of which every beginning is spread over the first photo: by a fixed pseudo-random key.
function spread(points) {
  return points
    .map((p, i) => ({ p, key: (Math.imul(i + 1, 2654435761) >>> 0) % 1000003 }))
    .sort((a, b) => a.key - b.key)
    .map(({ p }) => p);
}
