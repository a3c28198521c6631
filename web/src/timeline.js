// All events of a session in order, and the state at the time that is shown: now, or an earlier one.
import { emptyState, fold, foldUpTo } from './fold.js';

export class Timeline {
  constructor() {
    this.reset();
  }

  reset() {
    this.events = [];
    this.live = emptyState();
    this.shown = this.live;
    this.utime = null; // null: now
    this.cursor = 0; // events folded into a past state
  }

  // In the order of seq. Older ones than the newest are ignored.
  add(events) {
    let added = 0;
    for (const event of events) {
      if (event.seq <= this.live.head) continue;
      this.events.push(event);
      fold(this.live, event);
      added++;
    }
    return added;
  }

  get isLive() {
    return this.utime === null;
  }
  get start() {
    return this.live.firstUtime || (this.events[0]?.t ?? 0);
  }
  get end() {
    return this.live.utime;
  }

  // Shows the state at `utime`; null: now. Costs the events in between when time goes forward, else all up to it.
  show(utime) {
    if (utime === null) {
      this.utime = null;
      this.shown = this.live;
      return;
    }
    const forward = this.utime !== null && utime >= this.utime;
    this.utime = utime;
    if (!forward) {
      this.shown = foldUpTo(this.events, utime);
      this.cursor = this.events.findIndex((e) => e.seq > this.shown.head);
      if (this.cursor < 0) this.cursor = this.events.length;
      return;
    }
    while (this.cursor < this.events.length && this.events[this.cursor].t <= utime) {
      fold(this.shown, this.events[this.cursor++]);
    }
  }
}
