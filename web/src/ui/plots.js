// Small plots as SVG: as many points as there are pixels, one axis label each way.
import { median } from '../median.js';
import { setText, svg } from './dom.js';

const kWidth = 300;
const kHeight = 56;

// A plot of one series with its highest value at the left edge. `label`: for those who don't see it.
export class Plot {
  constructor(label, { format, colour = 'accent' }) {
    this.format = format;
    this.line = svg('path', { class: `plot_line ${colour}` });
    this.area = svg('path', { class: `plot_area ${colour}` });
    this.dots = svg('path', { class: `plot_dots ${colour}` });
    this.title = svg('title');
    this.element = svg(
      'svg', { viewBox: `0 0 ${kWidth} ${kHeight}`, class: 'plot', role: 'img', preserveAspectRatio: 'none', 'aria-label': label },
      this.title, svg('line', { x1: 0, x2: kWidth, y1: kHeight - 0.5, y2: kHeight - 0.5, class: 'plot_base' }),
      svg('line', { x1: 0, x2: kWidth, y1: 14.5, y2: 14.5, class: 'plot_grid' }), this.area, this.line, this.dots);
    this.label = label;
  }

  // [{x, y}], x ascending. `dots`: each by itself, with the running median as the line.
  set(series, { dots = null } = {}) {
    const all = dots ? dots.concat(series) : series;
    const highest = all.reduce((m, p) => Math.max(m, p.y), 1e-9);
    const from = all.reduce((m, p) => Math.min(m, p.x), Infinity);
    const to = all.reduce((m, p) => Math.max(m, p.x), -Infinity);
    const x = (v) => (to > from ? 2 + ((v - from) / (to - from)) * (kWidth - 4) : kWidth / 2);
    const y = (v) => kHeight - 2 - (v / highest) * (kHeight - 17);
    const path = thinned(series).map((p, i) => `${i ? 'L' : 'M'}${x(p.x).toFixed(1)} ${y(p.y).toFixed(1)}`).join('');
    this.line.setAttribute('d', path);
    const last = series.length ? x(series[series.length - 1].x).toFixed(1) : 0;
    const first = series.length ? x(series[0].x).toFixed(1) : 0;
    this.area.setAttribute('d', path ? `${path}L${last} ${kHeight}L${first} ${kHeight}Z` : '');
    this.dots.setAttribute('d', dots ? dots.map((p) => `M${x(p.x).toFixed(1)} ${y(p.y).toFixed(1)}h0`).join('') : '');
    const words = all.length ? `${this.label}: at most ${this.format(highest)}` : `${this.label}: nothing yet`;
    this.element.setAttribute('aria-label', words);
    setText(this.title, words);
    this.highest = all.length ? this.format(highest) : '';
  }
}

// At most 300 points: of each stretch the highest.
function thinned(series) {
  if (series.length <= kWidth) return series;
  const every = series.length / kWidth;
  const kept = [];
  for (let i = 0; i < kWidth; ++i) {
    const part = series.slice(Math.floor(i * every), Math.floor((i + 1) * every));
    kept.push(part.reduce((a, b) => (b.y > a.y ? b : a)));
  }
  return kept;
}

// Median of each value with those around it.
export function runningMedian(series, reach) {
  return series.map((p, i) => ({ x: p.x, y: median(series.slice(Math.max(0, i - reach), i + reach + 1).map((o) => o.y)) }));
}
