// The panel of what was clicked: a photo or a point.
import { agentColour } from '../colours.js';
import { photoName, standingOf } from '../fold.js';
import { uprightPoint, uprightSize } from '../orientation.js';
import { photoUrl, thumbnailUrl } from '../photo_urls.js';
import { bytes, clock, coordinateWords, explain, groups, linkWords, plural, seconds } from '../words.js';
import { h, icon, svg } from './dom.js';

const kMatchesShown = 60;

export class Inspect {
  constructor({ select, compare, lookAt, hover, clear }) {
    Object.assign(this, { select, compare, lookAt, hover, clear });
    this.element = h('div', { className: 'inspect' });
    this.signature = null;
  }

  update(view) {
    const { selection } = view;
    const signature = signatureOf(view);
    if (signature === this.signature) return;
    this.signature = signature;
    const focused = document.activeElement?.dataset?.keep;
    if (!selection) this.element.replaceChildren(this.nothing());
    else if (selection.image) this.element.replaceChildren(...this.photo(view, selection.image));
    else this.element.replaceChildren(...this.point(view, selection));
    if (focused) this.element.querySelector(`[data-keep="${CSS.escape(focused)}"]`)?.focus();
  }

  nothing() {
    return h('section', {}, h('h2', {}, 'Photo or point'), h('p', { className: 'muted' },
      'Click a camera to see its photo, how long each step took, and which photos it matches. Click a point to see which photos show it.'));
  }

  photo(view, image) {
    const { state } = view;
    const photo = state.photos.get(image);
    if (!photo) return [h('section', {}, h('h2', {}, 'Photo'), h('p', { className: 'muted' }, 'It had not arrived at that time.'))];
    const standing = standingOf(state, photo, view.diagnoses);
    const [width, height] = uprightSize(photo);
    const name = photoName(photo.agent, photo.name);
    const swatch = h('span', { className: 'swatch', 'aria-hidden': 'true' });
    swatch.style.background = agentColour(view.theme, state.agents.get(photo.agent)?.index ?? 0);
    return [
      h('section', { className: 'photo_head' },
        h('div', { className: 'head_row' }, h('h2', {}, swatch, name),
          h('button', { type: 'button', className: 'icon_button', 'aria-label': 'Deselect', title: 'Deselect (Esc)', onclick: this.clear, dataset: { keep: 'close' } }, icon('close'))),
        h('a', { href: photoUrl(photo), target: '_blank', rel: 'noopener', className: 'big_photo', title: 'Open the photo as it was stored' },
          h('img', { src: thumbnailUrl(photo), alt: `Photo ${name}`, width, height })),
        this.standing(view, photo, standing)),
      h('section', {}, h('h3', {}, 'Times'), times(photo)),
      h('section', {}, h('h3', {}, 'Photo'), facts(photo, standing)),
      this.matches(view, photo),
    ];
  }

  standing(view, photo, standing) {
    if (standing.standing === 'placed') {
      const { submap, trial } = standing;
      return h('div', { className: 'verdict placed' },
        h('p', {}, h('b', {}, `Placed in map ${submap.id}`), `${groups(trial.inliers)} of ${groups(trial.visible)} visible points fit${trial.errorPx ? `, ${trial.errorPx.toFixed(2)} px error` : ''}.`),
        h('button', { type: 'button', className: 'plain', onclick: () => this.lookAt(photo.id), dataset: { keep: 'look' } }, icon('look'), 'Look'));
    }
    if (standing.standing === 'waiting') return h('div', { className: 'verdict waiting' }, h('p', {}, h('b', {}, 'Waiting'), `It ${standing.reason}.`));
    const { what, help } = explain(standing);
    return h('div', { className: 'verdict unplaced' },
      h('p', {}, h('b', {}, standing.standing === 'failed' ? 'Failed' : 'Not placed'), what), h('p', { className: 'help' }, help),
      h('p', { className: 'muted' }, [linkWords(view.state, photo.id), standing.reason && `The service says: ${standing.reason}.`].filter(Boolean).join(' ')));
  }

  matches(view, photo) {
    const edges = [...(view.state.edges.get(photo.id) ?? [])].filter(([other]) => view.state.photos.has(other)).sort((a, b) => b[1] - a[1]);
    const most = edges[0]?.[1] ?? 1;
    const rows = edges.slice(0, kMatchesShown).map(([other, inliers]) => {
      const o = view.state.photos.get(other);
      const bar = h('span', { className: 'bar', 'aria-hidden': 'true' }, h('span'));
      bar.firstChild.style.width = `${(100 * inliers) / most}%`;
      bar.firstChild.style.background = agentColour(view.theme, view.state.agents.get(o.agent)?.index ?? 0);
      return h('li', { onpointerenter: () => this.hover(other), onpointerleave: () => this.hover(null) },
        h('button', {
          type: 'button', onclick: () => this.compare(photo.id, other), dataset: { keep: `m${other}` },
          'aria-label': `Compare with ${photoName(o.agent, o.name)}: ${plural(inliers, 'common point')}`,
          onfocus: () => this.hover(other), onblur: () => this.hover(null),
        },
        h('img', { src: thumbnailUrl(o), alt: '', loading: 'lazy', decoding: 'async', width: 64, height: 48 }),
        h('span', { className: 'text' }, h('span', { className: 'name' }, photoName(o.agent, o.name)), bar, h('small', {}, plural(inliers, 'common point')))),
        h('button', { type: 'button', className: 'icon_button', 'aria-label': `Select ${photoName(o.agent, o.name)}`, title: 'Select this photo', onclick: () => this.select(other) }, icon('look')));
    });
    const more = edges.length > kMatchesShown ? h('p', { className: 'muted' }, `And ${plural(edges.length - kMatchesShown, 'weaker one')}.`) : null;
    return h('section', {}, h('h3', {}, edges.length ? `Matches ${plural(edges.length, 'photo')}` : 'Matches'),
      edges.length ? h('ul', { className: 'matches' }, rows) : h('p', { className: 'muted' }, photo.matched ? 'No photo shows the same.' : 'Not compared yet.'), more);
  }

  point(view, selection) {
    const { seen } = selection;
    const parts = [h('div', { className: 'head_row' }, h('h2', {}, 'Point'),
      h('button', { type: 'button', className: 'icon_button', 'aria-label': 'Deselect', title: 'Deselect (Esc)', onclick: this.clear, dataset: { keep: 'close' } }, icon('close')))];
    parts.push(places(view, selection));
    if (!seen) parts.push(h('p', { className: 'muted' }, 'Asking who sees it…'));
    else if (seen.error) parts.push(h('p', { className: 'muted' }, seen.error));
    else if (selection.photo || selection.isMesh) {
      parts.push(h('p', {}, seen.photos.length ? 'A point of the surface. It is from the depth map of this photo.' : 'A point of the surface.'));
      parts.push(h('ul', { className: 'sightings' }, seen.photos.map((s) => this.sighting(view, s))));
    } else {
      parts.push(h('p', {}, `${plural(seen.photos.length, 'photo')} of map ${selection.submap} ${seen.photos.length === 1 ? 'sees' : 'see'} it.`));
      parts.push(h('ul', { className: 'sightings' }, seen.photos.map((s) => this.sighting(view, s))));
    }
    return [h('section', {}, parts)];
  }

  sighting(view, { image, x, y }) {
    const photo = view.state.photos.get(image) ?? view.timeline.live.photos.get(image);
    if (!photo) return null;
    const [u, v] = uprightPoint(photo.orientation, x / photo.width, y / photo.height);
    const [width, height] = uprightSize(photo);
    const mark = svg('svg', { viewBox: `0 0 ${width} ${height}`, class: 'mark_layer', 'aria-hidden': 'true' },
      svg('circle', { cx: u * width, cy: v * height, r: width / 26, class: 'mark_halo' }),
      svg('circle', { cx: u * width, cy: v * height, r: width / 26, class: 'mark_ring' }));
    return h('li', { onpointerenter: () => this.hover(image), onpointerleave: () => this.hover(null) },
      h('button', { type: 'button', onclick: () => this.select(image), title: photoName(photo.agent, photo.name), 'aria-label': `Photo ${photoName(photo.agent, photo.name)}` },
        h('span', { className: 'marked' }, h('img', { src: thumbnailUrl(photo), alt: '', loading: 'lazy', width, height }), mark),
        h('small', {}, photoName(photo.agent, photo.name))));
  }
}

// What the panel shows: it is made anew only when that changes, so that the focus and the scroll position stay.
function signatureOf(view) {
  const { state, selection, theme } = view;
  if (!selection) return 'none';
  if (!selection.image) return JSON.stringify(['point', theme, selection.submap, selection.chunk, selection.index, selection.photo, selection.isMesh, selection.seen ?? null]);
  const photo = state.photos.get(selection.image);
  if (!photo) return `absent ${selection.image}`;
  const { submap, trial, ...standing } = standingOf(state, photo, view.diagnoses);
  const edges = state.edges.get(photo.id);
  return JSON.stringify([
    theme, photo.id, photo.described, photo.matched, photo.firstPlaced, standing, submap?.id, trial?.inliers, edges?.size,
    [...(edges ?? [])].slice(-3),
  ]);
}

const kSteps = [
  ['stored', 'Received'], ['described', 'Features'], ['matched', 'Matched'], ['firstPlaced', 'Placed'],
];

// From its offer to its place: a bar with a part for each step.
function times(photo) {
  const until = photo.firstPlaced || photo.matched || photo.described || photo.stored;
  const total = Math.max(until - photo.received, 1);
  const bar = h('div', { className: 'steps', 'aria-hidden': 'true' });
  const list = h('ol', { className: 'step_list' });
  let before = photo.received;
  for (const [key, label] of kSteps) {
    const at = photo[key];
    const part = at ? h('span', { className: key }) : null;
    if (part) {
      part.style.flexGrow = String(Math.max((at - before) / total, 0.002));
      bar.append(part);
    }
    list.append(h('li', { className: at ? key : `${key} open` }, h('span', {}, label),
      h('b', {}, at ? `+${seconds((at - photo.received) / 1e6)}` : '–')));
    if (at) before = at;
  }
  return h('div', {}, bar, list);
}

// In the map's own frame, as its model has it, and on earth where GPS tells.
function places({ timeline }, { submap, own, at }) {
  const nameOf = (image) => {
    const photo = timeline.live.photos.get(image);
    return photo ? photoName(photo.agent, photo.name) : `photo ${image}`;
  };
  const rows = at ? coordinateWords(at, nameOf) : [];
  rows.push([`Map ${submap}`, own.map((v) => Number(v.toPrecision(6))).join(', ')]);
  return rowsOf(rows);
}

const rowsOf = (rows) => h('dl', { className: 'facts' }, rows.map(([k, v]) => h('div', {}, h('dt', {}, k), h('dd', {}, v))));

function facts(photo, standing) {
  const rows = [
    ['Agent', photo.agent || 'no name'],
    ['Size', `${photo.width} × ${photo.height} px, ${bytes(photo.bytes)}`],
    ['Taken', photo.captured ? new Date(photo.captured / 1000).toLocaleString() : 'not told'],
    ['Received', clock(photo.received)],
    ['Focal length', photo.focal ? `${groups(photo.focal)} px` : '–'],
    ['Keypoints', photo.keypoints === null ? '–' : groups(photo.keypoints)],
  ];
  if (photo.gps) rows.push(['GPS', photo.gps.slice(0, 2).map((v) => v.toFixed(6)).join(', ') + (Number.isFinite(photo.gps[2]) ? `, ${photo.gps[2].toFixed(1)} m` : '')]);
  if (standing.trial?.s) rows.push(['Mapping', seconds(standing.trial.s)]);
  return rowsOf(rows);
}
