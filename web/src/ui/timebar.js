// The time slider: when photos came and were placed, and a replay.
import { clock, seconds } from '../words.js';
import { byId, h, icon, setText, svg } from './dom.js';

const kSpeeds = [1, 5, 20, 100];
const kBins = 120;
const kLongestRestS = 1.5; // of a replay in which nothing happens

export class Timebar {
  // show(utime or null)
  constructor(timeline, { show }) {
    this.timeline = timeline;
    this.show = show;
    this.playing = false;
    this.playButton = h('button', { type: 'button', className: 'icon_button', onclick: () => this.toggle() });
    this.speed = h('select', { 'aria-label': 'Replay speed', onchange: () => {} }, kSpeeds.map((s) => h('option', { value: s }, `${s}×`)));
    this.speed.value = '5';
    this.slider = h('input', { type: 'range', min: 0, max: 1000, value: 1000, step: 1, 'aria-label': 'Time of the session', oninput: () => this.slid() });
    this.bars = svg('path', { class: 'bars_received' });
    this.placedBars = svg('path', { class: 'bars_placed' });
    this.chart = svg('svg', { viewBox: `0 0 ${kBins} 24`, preserveAspectRatio: 'none', class: 'time_chart', 'aria-hidden': 'true' }, this.bars, this.placedBars);
    this.time = h('span', { className: 'time_text' });
    this.nowButton = h('button', { type: 'button', className: 'now', 'aria-label': 'Now', onclick: () => this.toNow() }, 'Now');
    byId('timeline').append(this.playButton, this.speed, h('div', { className: 'track' }, this.chart, this.slider), this.time, this.nowButton);
    this.setPlaying(false);
  }

  get span() {
    return Math.max(this.timeline.end - this.timeline.start, 1);
  }

  slid() {
    const f = Number(this.slider.value) / 1000;
    this.setPlaying(false);
    this.show(f >= 1 ? null : this.timeline.start + f * this.span);
  }

  toNow() {
    this.setPlaying(false);
    this.show(null);
  }

  toggle() {
    if (this.timeline.events.length === 0) return;
    this.setPlaying(!this.playing);
    if (!this.playing) return;
    if (this.timeline.isLive) this.show(this.timeline.start);
    this.last = performance.now();
    this.step();
  }

  setPlaying(playing) {
    this.playing = playing;
    this.playButton.replaceChildren(icon(playing ? 'pause' : 'play'));
    const label = playing ? 'Pause the replay' : 'Replay';
    this.playButton.setAttribute('aria-label', label);
    this.playButton.title = label;
  }

  // Time goes by; where nothing happens for long it is skipped.
  step() {
    if (!this.playing) return;
    const now = performance.now();
    const speed = Number(this.speed.value);
    let utime = this.timeline.utime + Math.min(now - this.last, 500) * 1000 * speed;
    this.last = now;
    const next = this.timeline.events[this.timeline.cursor];
    if (next && next.t - utime > kLongestRestS * 1e6 * speed) utime = next.t - kLongestRestS * 1e6 * speed;
    if (utime >= this.timeline.end) {
      this.toNow();
      return;
    }
    this.show(utime);
    setTimeout(() => this.step(), 60);
  }

  update({ state }) {
    const { timeline } = this;
    const some = timeline.events.length > 1;
    byId('timeline').classList.toggle('idle', !some);
    this.playButton.disabled = this.slider.disabled = this.speed.disabled = !some;
    const at = timeline.isLive ? timeline.end : timeline.utime;
    const value = String(timeline.isLive ? 1000 : Math.round((1000 * (at - timeline.start)) / this.span));
    if (this.slider.value !== value) this.slider.value = value;
    this.nowButton.disabled = timeline.isLive;
    const into = seconds((at - timeline.start) / 1e6);
    const text = some ? `${clock(at)} · ${into} of ${seconds(this.span / 1e6)}` : '';
    setText(this.time, text);
    this.slider.setAttribute('aria-valuetext', some ? `${clock(at)}, ${into} after the first photo` : 'nothing yet');
    this.drawChart(timeline.live, state);
  }

  drawChart(live) {
    const key = `${live.head}`;
    if (key === this.drawn) return;
    this.drawn = key;
    const received = new Array(kBins).fill(0);
    const placed = new Array(kBins).fill(0);
    const bin = (t) => Math.min(kBins - 1, Math.max(0, Math.floor(((t - this.timeline.start) / this.span) * kBins)));
    for (const photo of live.photos.values()) {
      received[bin(photo.received)]++;
      if (photo.firstPlaced) placed[bin(photo.firstPlaced)]++;
    }
    const highest = Math.max(1, ...received, ...placed);
    const path = (counts) => counts.map((n, i) => (n ? `M${i + 0.1} 24v${(-22 * n) / highest}h0.8V24z` : '')).join('');
    this.bars.setAttribute('d', path(received));
    this.placedBars.setAttribute('d', path(placed));
  }
}
