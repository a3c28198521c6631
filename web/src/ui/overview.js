// Agents, pace, backlog, processes, downloads.
import { agentColour } from '../colours.js';
import { percentile, standingOf } from '../fold.js';
import { guidanceOf } from '../guidance.js';
import { ago, bytes, clock, groups, plural, seconds, sentence } from '../words.js';
import { h, icon, keyed, setText } from './dom.js';
import { Finish } from './finish.js';
import { Plot, runningMedian } from './plots.js';

const kDownloads = [
  ['/download/model.zip', 'COLMAP model', 'cameras, poses and points, .zip'],
  ['/download/points.ply', 'Point cloud', 'for viewers and CAD, .ply'],
  ['/download/nerfstudio.zip', 'nerfstudio', 'poses and points, .zip; the photos are those of the session'],
];
// What cannot be placed is told in place of the file.
const kOnEarth = [
  ['/download/model.zip?georeferenced', 'COLMAP model in metres', 'east, north and up, by the photos\u2019 GPS, .zip'],
  ['/download/points.ply?georeferenced', 'Point cloud in metres', 'east, north and up, by the photos\u2019 GPS, .ply'],
];
const kStages = [
  ['features', 'Features', 'photos that wait for their keypoints'],
  ['retrieval', 'Retrieval', 'photos that wait for their candidates'],
  ['matching', 'Matching', 'photos that wait for their matches'],
  ['mapper', 'Mapping', 'photos that wait for their place'],
];
const kBacklogKept = 600;
const kSilentS = 3;
const kVerdicts = new Set(['growing', 'weak', 'nearly', 'complete']);

export class Overview {
  constructor({ followAgent }) {
    this.followAgent = followAgent;
    this.agents = h('ul', { className: 'rows agents' });
    this.noAgents = h('p', { className: 'muted' }, 'No photo has come yet.');
    this.places = h('ul', { className: 'rows places' });
    this.advice = h('ul', { className: 'rows advice' });
    this.placesPart = h('section', { className: 'places_part', hidden: true }, h('h2', {}, 'How complete it is'), this.places, this.advice);
    this.latency = new Plot('Seconds from received to placed', { format: seconds });
    this.latencyWords = h('p', { className: 'figures' });
    this.latencyTop = h('span', { className: 'plot_top' });
    this.backlog = new Plot('Photos waiting over time', { format: groups, colour: 'waiting' });
    this.backlogTop = h('span', { className: 'plot_top' });
    this.stages = h('dl', { className: 'stages' });
    this.stageValues = new Map(kStages.map(([key, label, title]) => {
      const value = h('dd', {}, '0');
      this.stages.append(h('div', { title }, h('dt', {}, label), value));
      return [key, value];
    }));
    this.processes = h('ul', { className: 'rows processes' });
    this.processesPart = h('details', {}, h('summary', {}, 'Processes'), this.processes);
    this.downloads = h('div', { className: 'downloads' });
    this.finish = new Finish();
    this.latencyPart = h('section', {}, h('h2', {}, 'From received to placed'), this.latencyWords, h('div', { className: 'plot_box' }, this.latency.element, this.latencyTop));
    this.backlogPart = h('section', {}, h('h2', {}, 'Waiting'), h('div', { className: 'plot_box' }, this.backlog.element, this.backlogTop), this.stages);
    this.element = h(
      'div', {},
      h('section', {}, h('h2', {}, 'Agents'), this.noAgents, this.agents),
      this.placesPart, this.latencyPart, this.backlogPart,
      this.finish.element,
      h('section', {}, h('h2', {}, 'Downloads'), this.downloads),
      h('section', { className: 'processes_part' }, this.processesPart));
    this.showDownloads(false, false);
  }

  showDownloads(ready, hasGps) {
    const shown = `${ready} ${hasGps}`;
    if (this.downloadsShown === shown) return;
    this.downloadsShown = shown;
    const link = (how) => ([href, label, what]) => h(
      'a', { href, ...how, className: 'download' }, icon('download'), h('span', {}, h('b', {}, label), h('small', {}, what)));
    this.downloads.replaceChildren(...(ready
      ? [...kDownloads.map(link({ download: true })), ...(hasGps ? kOnEarth.map(link({ target: '_blank' })) : [])]
      : [h('p', { className: 'muted' }, 'Once there is a map: as a COLMAP model, a point cloud, or for nerfstudio.')]));
  }

  update(view) {
    this.updateAgents(view);
    this.updatePlaces(view);
    this.updateLatency(view);
    this.updateBacklog(view);
    this.updateProcesses(view);
    this.finish.update(view);
    this.showDownloads(
      [...view.timeline.live.submaps.values()].some((s) => !s.ended && (s.state === 'checkpoint' || s.state === 'final')),
      [...view.timeline.live.photos.values()].some((p) => p.gps));
  }

  updateAgents(view) {
    const { placedOf, receivedOf } = view.summary;
    const agents = [...view.state.agents.values()];
    // All that they sent was refused.
    for (const name of receivedOf.keys()) if (!view.state.agents.has(name)) agents.push({ name, index: agents.length, last: 0 });
    keyed(this.agents, agents, (a) => a.name, (a) => {
      const swatch = h('span', { className: 'swatch', 'aria-hidden': 'true' });
      const row = h('li', {},
        h('button', { type: 'button', className: 'row', onclick: () => this.followAgent(a.name), title: 'Look at the newest photo of this agent' },
          swatch, h('span', { className: 'name' }, a.name || 'no name'),
          h('span', { className: 'bar', 'aria-hidden': 'true' }, h('span')), h('span', { className: 'value' }), h('small')));
      return row;
    }, (row, a) => {
      const placed = placedOf.get(a.name) ?? 0;
      const received = receivedOf.get(a.name) ?? 0;
      const [swatch, , bar, value, last] = row.firstChild.children;
      swatch.style.background = agentColour(view.theme, a.index);
      bar.firstChild.style.width = `${(100 * placed) / Math.max(received, 1)}%`;
      bar.firstChild.style.background = agentColour(view.theme, a.index);
      setText(value, `${groups(placed)} of ${groups(received)} placed`);
      setText(last, a.last === 0 ? 'no photo that could be used' : `last photo ${view.session.live === false ? clock(a.last) : ago((view.utimeNow - a.last) / 1e6)}`);
    });
    this.noAgents.hidden = agents.length > 0;
  }

  // What the guide says: of the present alone.
  updatePlaces(view) {
    const { guidance, advice } = guidanceOf(view);
    this.placesPart.hidden = guidance.length === 0;
    keyed(this.places, guidance, (g) => g.submap,
      () => h('li', { className: 'place' }, h('span', { className: 'light', 'aria-hidden': 'true' }), h('span', { className: 'name' }), h('span', { className: 'value' }), h('small')),
      (row, g) => {
        const [light, name, value, what] = row.children;
        light.className = `light ${kVerdicts.has(g.verdict) ? g.verdict : 'growing'}`;
        setText(name, `Map ${g.submap}`);
        setText(value, g.verdict === 'growing' ? 'too early to say' : `${Math.floor(100 * g.good_share)} % good`);
        setText(what, sentence(g.sentence));
      });
    keyed(this.advice, advice.filter((a) => a.stations.length > 0), (a) => a.agent,
      () => h('li', { className: 'place' }, h('span', { className: 'swatch', 'aria-hidden': 'true' }), h('span', { className: 'name' }), h('span', { className: 'value' }), h('small')),
      (row, a) => {
        const [swatch, name, value, what] = row.children;
        swatch.style.background = agentColour(view.theme, view.state.agents.get(a.agent)?.index ?? 0);
        setText(name, a.agent || 'no name');
        setText(value, `${plural(a.stations.length, 'photo')} to take`);
        setText(what, sentence(a.stations[0].sentence));
        row.title = a.stations.map((s, i) => `${i + 1}. ${s.sentence}`).join('\n');
      });
  }

  updateLatency(view) {
    const dots = view.summary.latencies.map((l) => ({ x: l.t, y: l.s }));
    this.latency.set(runningMedian(dots, 3), { dots });
    setText(this.latencyTop, this.latency.highest);
    const values = dots.map((d) => d.y);
    this.latencyPart.hidden = values.length === 0;
    const p50 = percentile(values, 50);
    setText(this.latencyWords, values.length === 0
      ? ''
      : `half within ${seconds(p50)}, 95 % within ${seconds(percentile(values, 95))}; last ${seconds(values[values.length - 1])}`);
  }

  // How many photos waited before and after each event that changed that: of facts alone, so replays have it, too.
  updateBacklog(view) {
    const steps = [];
    for (const photo of view.state.photos.values()) {
      steps.push([photo.received, 1]);
      const done = photo.firstPlaced || whenGivenUp(view.state, photo);
      if (done) steps.push([done, -1]);
    }
    this.backlogPart.hidden = steps.length === 0;
    steps.sort((a, b) => a[0] - b[0]);
    let count = 0;
    const series = steps.flatMap(([x, d]) => [{ x, y: count }, { x, y: (count += d) }]);
    this.backlog.set(series.length > kBacklogKept ? series.filter((_, i) => i % Math.ceil(series.length / kBacklogKept) === 0) : series);
    setText(this.backlogTop, this.backlog.highest);
    this.stages.hidden = !view.status?.backlog || !view.timeline.isLive || view.session.live === false;
    for (const [key, value] of this.stageValues) setText(value, groups(view.status?.backlog?.[key] ?? 0));
  }

  updateProcesses(view) {
    const processes = view.status?.processes ?? [];
    this.processesPart.hidden = processes.length === 0;
    if (processes.length === 0) return;
    const silent = processes.filter((p) => p.seen_s > kSilentS).length;
    setText(this.processesPart.firstChild, `Processes: ${groups(processes.length)}${silent ? `, ${silent} silent` : ''}`);
    this.processesPart.classList.toggle('warn', silent > 0);
    keyed(this.processes, processes, (p) => p.instance,
      () => h('li', { className: 'process' }, h('span', { className: 'name' }), h('span', { className: 'value' }), h('small')),
      (row, p) => {
        const [name, value, what] = row.children;
        setText(name, String(p.instance));
        setText(value, `${p.backlog ? `${plural(p.backlog, 'item')}, ` : ''}${bytes(p.memory)}`);
        setText(what, p.seen_s > kSilentS ? `silent for ${seconds(p.seen_s)}` : String(p.state ?? ''));
        row.classList.toggle('warn', p.seen_s > kSilentS);
      });
  }
}

// When a photo that was never placed was found to have no place so far; 0: it waits.
function whenGivenUp(state, photo) {
  const { standing, trial } = standingOf(state, photo);
  if (standing === 'failed') return photo.failed.t;
  return standing === 'unplaced' ? trial?.t || photo.matched || photo.described : 0;
}
