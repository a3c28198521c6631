// The header: is the page up to date, how many photos stand where, what happens now.
import { ago, clock, groups, whatHappens } from '../words.js';
import { byId, h, setText } from './dom.js';

const kCounts = [
  ['received', 'Received', 'Photos that have arrived'],
  ['placed', 'Placed', 'Photos whose position is known'],
  ['waiting', 'Waiting', 'Photos whose place is being looked for'],
  ['unplaced', 'Not placed', 'Photos that were tried in vain, or failed'],
];

const kAnnounceMs = 15000;

export class Header {
  constructor({ openUnplaced }) {
    this.values = {};
    const list = byId('counts');
    for (const [key, label, title] of kCounts) {
      const value = h('dd', {}, '0');
      this.values[key] = value;
      const aside = h('span', { className: 'aside', hidden: true });
      if (key === 'unplaced') this.dismissed = aside;
      const content = [h('dt', {}, label, aside), value];
      list.append(h('div', { className: `count ${key}`, title }, content));
    }
    this.values.unplaced.parentElement.addEventListener('click', openUnplaced);
    this.connection = byId('connection');
    this.announced = -Infinity;
  }

  update(view) {
    const { counts, notPlaced, dismissed } = view.summary;
    const numbers = { received: counts.received, placed: counts.placed, waiting: counts.waiting, unplaced: notPlaced - dismissed };
    this.dismissed.hidden = dismissed === 0;
    setText(this.dismissed, `${groups(dismissed)} dismissed`);
    for (const [key, value] of Object.entries(this.values)) {
      setText(value, groups(numbers[key]));
      value.parentElement.classList.toggle('none', numbers[key] === 0);
    }
    const sentence = view.timeline.isLive
      ? whatHappens(view.state, view.summary, view.session.live === false ? 'stored' : 'live')
      : `As it was at ${clock(view.timeline.utime)}. ${whatHappens(view.state, view.summary, 'past')}`;
    setText(byId('sentence'), sentence);
    this.announce(sentence);
    setText(byId('folder'), lastPart(view.session.folder));
    byId('folder').title = view.session.folder ?? '';
    document.title = counts.received ? `${counts.placed}/${counts.received} placed · Skein` : 'Skein';
    this.tellConnection(view);
  }

  // Screen readers hear what happens now and then, not ten times a second.
  announce(sentence) {
    const now = performance.now();
    if (now - this.announced < kAnnounceMs || sentence === this.last) return;
    this.announced = now;
    this.last = sentence;
    setText(byId('announce'), sentence);
  }

  tellConnection({ connection, session, timeline, now }) {
    let kind = 'live';
    let text = 'Live';
    if (!connection.connected) {
      kind = 'lost';
      text = connection.refused ? `Not connected: ${connection.refused}`
        : connection.heard === null ? 'Not connected: no answer yet' : `Not connected: last heard ${ago((now - connection.heard) / 1000)}`;
    } else if (!timeline.isLive) {
      kind = 'past';
      text = `Replay, ${clock(timeline.utime)}`;
    } else if (session.live === false) {
      kind = 'still';
      text = 'Stored session';
    }
    this.connection.className = kind;
    setText(this.connection, text);
  }
}

function lastPart(path) {
  return (path ?? '').split('/').filter(Boolean).pop() ?? '';
}
