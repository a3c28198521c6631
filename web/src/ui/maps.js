// Submaps and their merges. On the page a submap is called a map.
import { mapColour } from '../colours.js';
import { liveSubmaps } from '../fold.js';
import { clock, mergeWords, plural, seconds, submapWords } from '../words.js';
import { h, keyed, setText } from './dom.js';

export class Maps {
  constructor({ lookAt }) {
    this.maps = h('ul', { className: 'rows maps' });
    this.merges = h('ol', { className: 'rows merges' });
    this.none = h('p', { className: 'muted' }, 'Two photos that overlap well begin a map.');
    this.mergesPart = h('section', {}, h('h2', {}, 'Joining'), this.merges);
    this.ended = h('ul', { className: 'rows ended' });
    this.endedPart = h('details', {}, h('summary', {}, 'Earlier maps'), this.ended);
    this.lookAt = lookAt;
    this.element = h('div', {}, h('section', {}, h('h2', {}, 'Maps'), this.none, this.maps), this.mergesPart, this.endedPart);
  }

  update(view) {
    const live = liveSubmaps(view.state).sort((a, b) => b.numRegistered - a.numRegistered);
    this.none.hidden = live.length > 0;
    keyed(this.maps, live, (s) => s.id, (s) => h('li', {},
      h('button', { type: 'button', className: 'row', onclick: () => this.lookAt(s.id), title: 'Look at this map' },
        h('span', { className: 'swatch', 'aria-hidden': 'true' }), h('span', { className: 'name' }), h('span', { className: 'value' }), h('small'))),
    (row, s) => {
      const [swatch, name, value, what] = row.firstChild.children;
      swatch.style.background = mapColour(view.theme, s.id);
      setText(name, `Map ${s.id}`);
      const points = view.pointsOf(s.id) || s.points;
      setText(value, `${plural(s.numRegistered, 'photo')}${points ? `, ${plural(points, 'point')}` : ''}`);
      const merge = view.state.merges.get(s.openMerge);
      const parts = [submapWords(s, merge?.source === s.id)];
      if (s.errorPx) parts.push(`${s.errorPx.toFixed(2)} px error`);
      if (s.expectedErrorPercent) parts.push(`expected position error ${s.expectedErrorPercent.toFixed(2)} % of its extent`);
      setText(what, parts.join(' · '));
    });
    const merges = [...view.state.merges.values(), ...latestFailed(view.state)].sort((a, b) => b.t - a.t);
    this.mergesPart.hidden = merges.length === 0;
    keyed(this.merges, merges, (m) => (m.state === 'failed' ? `f${m.source}/${m.target}` : m.id),
      () => h('li', {}, h('span', { className: 'what' }), h('small')),
      (row, m) => {
        row.className = `merge ${m.state}`;
        setText(row.children[0], mergeWords(m));
        setText(row.children[1], clock(m.t) + (m.state === 'done' && m.s ? `, ${seconds(m.s)}` : ''));
      });
    const ended = [...view.state.submaps.values()].filter((s) => s.ended);
    this.endedPart.hidden = ended.length === 0;
    keyed(this.ended, ended, (s) => s.id, () => h('li', {}), (row, s) => setText(row, `Map ${s.id}: ${submapWords(s)}`));
  }
}

// Attempts are repeated as maps grow: of each pair the last one, and none that succeeded later.
function latestFailed(state) {
  const last = new Map();
  for (const m of state.failedMerges) last.set(`${m.source}/${m.target}`, m);
  return [...last.values()].filter((m) => ![m.source, m.target].some((id) => state.submaps.get(id)?.ended));
}
