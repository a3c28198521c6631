// The page: what comes from the server goes into the timeline and the shapes; what is shown follows from them.
import { storedChoice, storedTheme, storeChoice, systemTheme } from './choices.js';
import { kGrid, kMark, kPaper, rgb } from './colours.js';
import { kDense } from './dense.js';
import { Dismissed } from './dismissed.js';
import { doorOf, kConnecting, kUnreachable } from './door.js';
import { Feed } from './feed.js';
import { heirOf, liveSubmaps, notPlacedOf, placeOf, standingOf, summarize } from './fold.js';
import { guidanceOf } from './guidance.js';
import { kMesh } from './mesh.js';
import { thumbnailUrl } from './photo_urls.js';
import * as sim from './similarity.js';
import { Shapes } from './shapes.js';
import { Timeline } from './timeline.js';
import { Compare } from './ui/compare.js';
import { byId, h, iconButton, setText } from './ui/dom.js';
import { showDoor } from './ui/door.js';
import { Header } from './ui/header.js';
import { showHelp } from './ui/help.js';
import { showInvite } from './ui/invite.js';
import { Inspect } from './ui/inspect.js';
import { Labels } from './ui/labels.js';
import { Legend } from './ui/legend.js';
import { Maps } from './ui/maps.js';
import { Measure } from './ui/measure.js';
import { Newest } from './ui/newest.js';
import { Overview } from './ui/overview.js';
import { Section } from './ui/section.js';
import { Settings } from './ui/settings.js';
import { Tabs } from './ui/tabs.js';
import { Timebar } from './ui/timebar.js';
import { showTroubles } from './ui/troubles.js';
import { Unplaced } from './ui/unplaced.js';
import { Viewer } from './view/viewer.js';
import { World } from './world.js';

const kPhonePoints = 2_000_000;
const kDefaultPoints = 10_000_000;
const kPhoneTriangles = 300_000;
const kDefaultTriangles = 1_000_000;
const kFaded = 0.55; // of points, in a replay, until it is known when each came
const kUpdateMs = 120;
const kSurfaceLabel = 'Surface instead of points (P)';
const kMeshLabel = 'Points, surface or mesh (P)';

const isPhone = () => matchMedia('(pointer: coarse)').matches;
const reducedMotion = () => matchMedia('(prefers-reduced-motion: reduce)').matches;

export class App {
  constructor() {
    this.timeline = new Timeline();
    this.dismissed = new Dismissed();
    this.session = {};
    this.status = null;
    this.connection = { connected: false, heard: null, refused: '' };
    this.hasTried = false; // to connect
    this.numConnections = 0;
    this.selection = null;
    this.follow = false;
    this.newest = 0;
    this.maxPoints = isPhone() ? kPhonePoints : kDefaultPoints;
    this.tintMaps = true;
    this.showsStations = true;
    this.showsConfidence = false;
    this.wants = storedChoice('points', ['surface', 'mesh']) ?? 'points'; // to be shown
    this.maxTriangles = isPhone() ? kPhoneTriangles : kDefaultTriangles;
    this.theme = 'dark';
    this.updatedAt = -Infinity;
    this.clockOffset = null; // utime of the server less performance.now(), in microseconds
  }

  start() {
    this.makeView();
    this.makePanels();
    this.makeTools();
    this.makeActions();
    this.applyTheme(storedTheme());
    matchMedia('(prefers-color-scheme: light)').addEventListener('change', () => this.applyTheme(storedTheme()));
    document.addEventListener('visibilitychange', () => {
      if (document.hidden) return;
      this.feed.retryNow();
      this.changed();
    });
    window.addEventListener('online', () => this.feed.retryNow());
    window.addEventListener('storage', (e) => {
      if (this.dismissed.heard(e.key)) this.changed();
    });
    document.addEventListener('keydown', (e) => this.shortcut(e));
    setInterval(() => this.tick(), 1000);
    this.connect();
    this.changed();
  }

  // ---- the server

  connect() {
    this.shapes = new Shapes({
      manifest: (id, manifest) => {
        this.world.setManifest(id, manifest);
        this.dense.pump(); // photos have got a place
        this.changed();
      },
      chunk: (id, chunkId, chunk) => {
        this.viewer.submaps.setChunk(id, chunkId, chunk);
        this.changed();
      },
      chunkGone: (id, chunkId) => this.viewer.submaps.dropChunk(id, chunkId),
      chunkCut: (id, chunkId, points) => this.viewer.submaps.cutChunk(id, chunkId, points),
      gone: (id) => {
        if (this.world.dropShape(id)) {
          this.dense.again(id);
          this.mesh.again(id);
        }
        this.changed();
      },
      load: (waiting) => {
        this.loading = waiting;
        this.changed();
      },
    }, { budget: this.maxPoints });
    this.dense = this.followDense();
    this.mesh = this.followMesh();
    this.feed = new Feed({
      reset: (id) => this.begin(id),
      events: (events) => this.take(events),
      synced: () => this.wantShapes(),
      shape: (message) => this.hear(this.shapes, message),
      dense: (message) => {
        this.hear(this.dense, message);
        this.hear(this.mesh, { ...message, gone: message.gone || !(message.triangles > 0) });
      },
      status: (message) => {
        this.status = message;
        this.changed();
      },
      connection: (connection) => {
        const again = connection.connected && !this.connection.connected;
        this.connection = connection;
        this.hasTried = true;
        if (again) this.numConnections++;
        if (again) this.askSession();
        if (again) {
          this.dense.doubt();
          this.mesh.doubt();
        }
        if (connection.connected && this.feed.synced) this.wantShapes();
        this.changed();
      },
    });
    this.feed.start();
  }

  // Nothing is loaded until the surface is to be shown.
  followDense() {
    return new Shapes({
      manifest: (id, manifest) => {
        this.world.setDense(id, manifest);
        this.changed();
      },
      chunk: (id, chunkId, chunk, { image }) => {
        this.viewer.submaps.setSurfaceChunk(id, chunkId, chunk, image);
        this.changed();
      },
      chunkGone: (id, chunkId) => this.viewer.submaps.dropSurfaceChunk(id, chunkId),
      chunkCut: (id, chunkId, points) => this.viewer.submaps.cutSurfaceChunk(id, chunkId, points),
      gone: (id) => {
        this.world.dropDense(id);
        this.changed();
      },
      load: (waiting) => {
        this.loadingDense = waiting;
        this.changed();
      },
    }, { budget: this.maxPoints, form: kDense, wants: (id, { image }) => this.world.hasPose(id, image), follows: this.wants === 'surface' });
  }

  // The same.
  followMesh() {
    return new Shapes({
      manifest: () => this.changed(),
      chunk: (id, chunkId, chunk, { frame }) => {
        this.world.setMeshChunk(id, chunkId, chunk, frame);
        this.changed();
      },
      chunkGone: (id, chunkId) => this.viewer.submaps.dropMeshChunk(id, chunkId),
      chunkCut: (id, chunkId, triangles) => this.viewer.submaps.cutMeshChunk(id, chunkId, triangles),
      gone: (id) => {
        this.viewer.submaps.dropMesh(id);
        this.changed();
      },
      load: (waiting) => {
        this.loadingMesh = waiting;
        this.changed();
      },
    }, { budget: this.maxTriangles, form: kMesh, follows: this.wants === 'mesh' });
  }

  begin(session) {
    this.timeline.reset();
    this.dismissed.open(session);
    this.measure.begin(session);
    this.section.reset();
    this.dense.reset();
    this.mesh.reset();
    this.shapes.reset();
    this.world.reset();
    this.status = null;
    this.newest = 0;
    this.newestCard.update();
    this.fittedCameras = this.fittedPoints = this.fittedMaps = this.turnedCameras = 0;
    this.select(null);
  }

  async askSession() {
    try {
      const answer = await fetch('/api/session', { cache: 'no-store' });
      if (answer.ok) this.session = await answer.json();
      byId('invite_button').hidden = !this.session.invites || this.session.visitor?.role === 'viewer';
      const limit = this.session.page_limits?.points;
      if (limit > 0 && !isPhone()) this.setMaxPoints(limit);
      this.changed();
    } catch {
      // The feed tells that the connection is lost.
    }
  }

  setMaxPoints(points) {
    if (points === this.maxPoints) return;
    this.maxPoints = points;
    this.viewer.submaps.setBudget(points);
    this.shapes.setBudget(points);
    this.dense.setBudget(points);
  }

  take(events) {
    this.timeline.add(events);
    const utime = events[events.length - 1].t;
    if (this.feed.synced) {
      this.clockOffset = utime - performance.now() * 1000;
      for (const event of events) this.react(event);
    }
    this.changed();
  }

  // What is seen as it happens, and not when a session's past is loaded.
  react(event) {
    if (event.kind === 'merge' && event.state === 'done') {
      const merge = this.timeline.live.merges.get(event.merge);
      if (merge && this.world.join(merge, performance.now() / 1000)) {
        this.shapes.announce(merge.target, 0);
      } else {
        this.drop(event.source);
      }
    } else if (event.kind === 'submap') {
      const submap = this.timeline.live.submaps.get(event.submap);
      if (submap && !submap.ended) this.shapes.announce(event.submap, 0);
      else if (submap && !submap.mergedInto) this.drop(event.submap);
    }
  }

  // Of every live submap: what was told while nobody listened is not told again.
  wantShapes() {
    for (const submap of liveSubmaps(this.timeline.live)) this.shapes.announce(submap.id, 0);
    for (const id of new Set([this.shapes, this.dense, this.mesh].flatMap((s) => [...s.submaps.keys()]))) {
      if (this.timeline.live.submaps.get(id)?.ended && !this.world.joining.has(id)) this.drop(id);
    }
  }

  // shapes: those that the message is of.
  hear(shapes, { submap, version, gone }) {
    if (!gone) shapes.announce(submap, version);
    else if (!this.world.joining.has(submap)) shapes.drop(submap);
    this.changed();
  }

  drop(submap) {
    this.dense.drop(submap);
    this.mesh.drop(submap);
    this.shapes.drop(submap);
  }

  // ---- what is shown

  makeView() {
    this.viewer = new Viewer(byId('canvas'), {
      pick: (hit) => this.picked(hit),
      hover: (hit) => this.hovered(hit),
      drawn: () => this.labels.place(),
      resized: () => this.resized(),
    }, { reducedMotion });
    this.viewer.submaps.setBudget(this.maxPoints);
    if (!this.viewer.renderer) this.notice('No 3D: this browser has no WebGL, or it is switched off. The panels work.');
    this.world = new World(this.viewer, this.timeline);
    const { viewer, world } = this;
    this.measure = new Measure({ viewer, world, timeline: this.timeline, notice: (text) => this.notice(text), changed: () => this.changed() });
    byId('messages').append(this.measure.form, this.measure.tools, this.measure.done);
    byId('stage').append(this.measure.chart.element);
    this.section = new Section({
      viewer, world, metresPerUnit: () => this.measure.displayMetres(),
      on: { changed: () => this.changed(), closed: () => this.settings.sectionEnded() },
    });
    byId('stage').append(this.section.element);
    this.legend = new Legend(byId('legend'));
    this.labels = new Labels({ viewer, world, measure: this.measure });
    byId('north').addEventListener('click', () => {
      viewer.controls.moved = true;
      viewer.controls.goTo({ yaw: 0 });
    });
  }

  // Everything follows in one go, soon, and at most eight times a second.
  changed() {
    if (this.updating || document.hidden) return;
    this.updating = true;
    const wait = Math.max(0, this.updatedAt + kUpdateMs - performance.now());
    setTimeout(() => {
      this.updating = false;
      this.updatedAt = performance.now();
      this.update();
    }, wait);
  }

  view() {
    const { timeline } = this;
    const state = timeline.shown;
    const diagnoses = this.diagnoses();
    return {
      state, timeline, diagnoses, summary: { ...summarize(state, diagnoses), dismissed: this.numDismissed(state) }, status: this.status, connection: this.connection, session: this.session,
      selection: this.selection, theme: this.theme, now: performance.now(), utimeNow: this.utimeNow(),
      pointsOf: (id) => (timeline.isLive ? this.world.shapes.get(id)?.manifest.chunks.reduce((n, c) => n + c.points, 0) ?? 0 : 0),
    };
  }

  // Of the newest status message, by image id: of the present alone.
  diagnoses() {
    return new Map(this.timeline.isLive ? this.status?.diagnoses?.map((d) => [d.image, d]) : []);
  }

  numDismissed(state) {
    return this.dismissed.list.length === 0 ? 0 : notPlacedOf(state, this.diagnoses()).filter(({ key }) => this.dismissed.has(key)).length;
  }

  // By the server's clock as far as it was heard: the browser's may be wrong.
  utimeNow() {
    if (!this.timeline.isLive) return this.timeline.utime;
    if (this.clockOffset === null) return Math.max(this.timeline.end, this.session.live === false ? 0 : Date.now() * 1000);
    return Math.max(this.timeline.end, this.clockOffset + performance.now() * 1000);
  }

  update() {
    if (this.feed.synced) this.dismissed.forgetPlaced(this.timeline.live);
    const view = this.view();
    const nowS = performance.now() / 1000;
    for (const id of this.world.takeJoined(nowS)) this.drop(id);
    if (this.world.joining.size > 0) setTimeout(() => this.changed(), 300);
    // Who takes the view into their hands follows no longer.
    if (this.follow && this.viewer.controls.moved) this.setFollow(false);
    this.updateNewest(view);
    this.world.place();
    const selected = this.selection?.image ?? 0;
    const cameras = this.world.showCameras({ theme: this.theme, selected, newest: this.newest });
    this.stations = this.world.showStations({ theme: this.theme, advice: this.showsStations ? guidanceOf(view).advice : [] });
    this.viewer.cameras.setBase(this.world.cameraBase());
    this.world.showTints(this.theme, this.tintMaps);
    this.showSurface();
    const ranking = this.world.showRanks();
    this.viewer.setFaded(ranking ? kFaded : 0);
    if (ranking) setTimeout(() => this.changed(), 0);
    if (selected) this.world.showLinks(selected, rgb(kMark[this.theme]));
    else this.viewer.cameras.setLinks([]);
    this.showPictures(view);
    this.autoFit(cameras.length);
    showTroubles(byId('troubles'), (view.timeline.isLive && view.status?.troubles) || []);
    this.header.update(view);
    this.timebar.update(view);
    this.updatePanels(view);
    this.labels.update(view, this.hoveredImage);
    this.updateEmpty(view);
    this.section.update(kGrid[this.theme]);
    this.measure.update(kMark[this.theme]);
  }

  // Of submaps that have a surface or a mesh: that, or their points. An earlier time has no mesh.
  showSurface() {
    const has = this.kindsToShow().length > 1;
    const on = this.dense.submaps.size > 0 && this.wants === 'surface';
    const isMesh = this.mesh.submaps.size > 0 && this.wants === 'mesh';
    this.world.showSurfaces();
    this.viewer.submaps.showSurfaces(on);
    this.viewer.submaps.showMeshes(isMesh && this.timeline.isLive);
    this.viewer.showConfidence(this.showsConfidence);
    this.legend.update({ on: this.showsConfidence, hasColours: on });
    const button = byId('tool_surface');
    const label = this.surfaceLabel(has, isMesh);
    button.disabled = !has;
    button.setAttribute('aria-pressed', String(on || isMesh));
    if (button.title === label) return;
    button.title = label;
    button.setAttribute('aria-label', label);
  }

  surfaceLabel(has, isMesh) {
    if (!has) return 'No surface yet: skein-dense makes it of photos that are placed';
    if (this.mesh.submaps.size === 0) return kSurfaceLabel;
    if (!isMesh || this.mesh.share >= 1) return kMeshLabel;
    return `${kMeshLabel}. The mesh is coarser than it was made: at most ${this.maxTriangles.toLocaleString('en')} triangles are drawn`;
  }

  // What P goes through.
  kindsToShow() {
    return ['points', ...(this.dense.submaps.size > 0 ? ['surface'] : []), ...(this.mesh.submaps.size > 0 ? ['mesh'] : [])];
  }

  tick() {
    if (document.hidden) return;
    this.header.tellConnection(this.view());
    if (this.timeline.isLive && this.tabs.current === 'overview') this.overview.updateAgents(this.view());
  }

  updateNewest({ state }) {
    const photo = state.photos.get(state.newestPlaced);
    const fresh = Boolean(photo) && this.newest !== photo.id;
    this.newest = photo?.id ?? 0;
    this.newestCard.update(photo);
    if (fresh && this.follow) this.wantFollow = photo.id;
    if (photo && this.wantFollow && this.viewer.cameras.placed.has(this.wantFollow)) {
      this.viewer.followCamera(this.wantFollow);
      this.wantFollow = 0;
    }
  }

  showPictures({ state }) {
    for (const [role, image] of [['newest', this.newest], ['selected', this.selection?.image ?? 0]]) {
      const twice = role === 'newest' && image === this.selection?.image;
      const photo = twice ? null : state.photos.get(image);
      this.viewer.cameras.pictures.set(role, photo?.id ?? 0, photo ? thumbnailUrl(photo) : '', photo?.orientation);
    }
  }

  // Until somebody takes the view into their hands it shows everything.
  autoFit(cameras) {
    if (this.viewer.controls.moved || this.follow) return;
    const points = this.viewer.submaps.numPoints;
    const grown = cameras > 1.25 * (this.fittedCameras ?? 0) || points > 1.6 * (this.fittedPoints ?? 0) ||
      this.world.measures.size !== this.fittedMaps;
    if (cameras < 2 || !grown) return;
    const turn = this.world.measures.size !== this.fittedMaps || cameras >= 2 * (this.turnedCameras ?? 0);
    Object.assign(this, { fittedCameras: cameras, fittedPoints: points, fittedMaps: this.world.measures.size });
    if (turn) this.turnedCameras = cameras;
    this.viewer.fit({ keepDirection: !turn });
  }

  resized() {
    // What is being measured stays where it is.
    if (this.fittedCameras && !this.viewer.controls.moved && !this.follow && this.measure.picked.length === 0) this.viewer.fit();
  }

  // ---- selecting

  picked(hit) {
    if (this.measure.active) {
      this.measure.pick(hit);
      return;
    }
    if (!hit) this.select(null);
    else if (hit.image) this.select({ image: hit.image });
    else this.selectPoint(hit);
  }

  select(selection) {
    this.selection = selection;
    if (selection) this.tabs.open('inspect');
    this.changed();
  }

  async selectPoint({ submap, chunk, index, version, own, point, photo, isMesh }) {
    const selection = { submap, chunk, index, version, own, point, photo, isMesh, at: this.world.coordinatesOf(submap, own), seen: null };
    if (photo) selection.seen = { photos: this.world.sightingsOf(submap, photo, own) };
    if (isMesh) selection.seen = { photos: [] };
    this.select(selection);
    if (selection.seen) return;
    try {
      const answer = await fetch(`/api/submaps/${submap}/chunks/${chunk}/points/${index}?v=${version}`);
      if (answer.status === 404) selection.seen = { error: 'The map has changed just now: click the point again.' };
      else if (!answer.ok) throw new Error(String(answer.status));
      else selection.seen = await answer.json();
    } catch {
      selection.seen = { error: 'Who sees it cannot be had now: the connection is lost, or the server failed.' };
    }
    this.changed();
  }

  hovered(hit) {
    byId('canvas').classList.toggle('over', Boolean(hit?.image));
    this.hoverImage(hit?.image ?? null);
  }

  hoverImage(image) {
    if (image === this.hoveredImage) return;
    this.hoveredImage = image;
    this.labels.update(this.view(), image);
    this.viewer.draw();
  }

  compare(a, b) {
    const { photos, edges } = this.timeline.live;
    this.compareDialog.show(photos.get(a), photos.get(b), edges.get(a)?.get(b) ?? 0);
  }

  updateEmpty({ summary, timeline, connection }) {
    const nothing = summary.counts.placed === 0 && timeline.isLive && this.viewer.submaps.numPoints === 0;
    if (nothing) showDoor(byId('empty'), this.whyEmpty(summary.counts.received, connection), connection.refused ? 'alert' : 'status');
    else byId('empty').hidden = true;
    // The header tells why, and what is shown stays.
    if (!nothing && connection.refused) this.notice(doorOf(connection.refused).help);
  }

  whyEmpty(received, { connected, heard, refused }) {
    if (refused) return doorOf(refused);
    if (!connected && heard === null) return this.hasTried ? kUnreachable : kConnecting;
    if (received > 0) return { title: 'The map begins soon', what: 'The first two photos that overlap well begin it.', help: '' };
    const help = byId('invite_button').hidden ? '' : 'Press Invite, at the upper right, to let a phone take them.';
    return { title: 'No photos yet', what: 'The map appears here as photos arrive.', help };
  }

  notice(text) {
    const element = byId('notice');
    element.hidden = !text;
    setText(element, text);
  }

  // ---- panels

  makePanels() {
    const select = (image) => this.select({ image });
    const hover = (image) => this.hoverImage(image);
    const lookAt = (image) => this.viewer.lookAtCamera(image);
    this.header = new Header({ openUnplaced: () => this.tabs.open('unplaced') });
    this.overview = new Overview({ followAgent: (agent) => this.showAgent(agent) });
    this.maps = new Maps({ lookAt: (id) => this.lookAtMap(id) });
    this.unplaced = new Unplaced({ select, dismissed: this.dismissed, dismiss: (key, on) => this.dismiss(key, on) });
    this.compareDialog = new Compare();
    this.inspect = new Inspect({ select, hover, lookAt, compare: (a, b) => this.compare(a, b), clear: () => this.select(null) });
    this.newestCard = new Newest({ lookAt: () => this.lookAtNewest() });
    this.timebar = new Timebar(this.timeline, { show: (utime) => this.showTime(utime) });
    this.tabs = new Tabs({ changed: () => this.changed() });
    this.tabs.add('overview', 'Overview', this.overview);
    this.tabs.add('maps', 'Maps', this.maps);
    this.tabs.add('unplaced', 'Not placed', this.unplaced);
    this.tabs.add('inspect', 'Photo', this.inspect);
    this.tabs.open('overview', { keepSheet: true });
  }

  dismiss(key, on) {
    this.dismissed.set(key, on);
    this.changed();
  }

  updatePanels(view) {
    const numMaps = liveSubmaps(view.state).length;
    const { notPlaced, dismissed } = view.summary;
    this.tabs.setBadge('unplaced', notPlaced > dismissed ? String(notPlaced - dismissed) : '');
    this.tabs.setBadge('maps', numMaps > 1 ? String(numMaps) : '');
    this.tabs.update(view);
  }

  showAgent(agent) {
    const { shown } = this.timeline;
    const photos = [...shown.photos.values()].filter((p) => p.agent === agent && placeOf(shown, p.id));
    const newest = photos.sort((a, b) => b.firstPlaced - a.firstPlaced)[0];
    if (!newest) return;
    this.viewer.controls.moved = true;
    this.select({ image: newest.id });
    this.viewer.followCamera(newest.id);
  }

  lookAtMap(id) {
    const heir = heirOf(this.timeline.live, id) || id;
    const place = this.viewer.submaps.placeOf(heir);
    const measure = this.world.measures.get(heir)?.measure;
    if (!place || !measure) return;
    this.viewer.controls.moved = true;
    this.viewer.controls.goTo({ target: sim.apply(place, measure.middle), distance: Math.max(3 * measure.reach * place.s, 3) });
  }

  showTime(utime) {
    this.timeline.show(utime);
    document.body.classList.toggle('replay', utime !== null);
    this.changed();
  }

  // ---- tools

  makeTools() {
    const { viewer } = this;
    this.settings = new Settings({
      pointPx: (px) => viewer.setPointPx(px),
      cameraScale: (scale) => viewer.cameras.setScale(scale),
      show: (what, on) => viewer.show(what, on),
      stations: (on) => {
        this.showsStations = on;
        this.changed();
      },
      tintMaps: (on) => {
        this.tintMaps = on;
        this.changed();
      },
      section: (on) => this.section.setActive(on),
      confidence: (on) => {
        this.showsConfidence = on;
        this.changed();
      },
    });
    const tool = (id, name, label, onclick, pressed) => iconButton(name, label, onclick, { id: `tool_${id}`, 'aria-pressed': pressed });
    byId('tools').append(
      tool('fit', 'fit', 'Show everything (F)', () => this.fit()),
      tool('follow', 'follow', 'Follow the newest photo (N)', () => this.setFollow(!this.follow), 'false'),
      tool('fly', 'fly', 'Fly: look around with the mouse, move with W A S D Q E (V)', () => this.setFlying(!viewer.controls.flying), 'false'),
      tool('measure', 'measure', 'Measure a distance or an area (M)', () => this.measure.setActive(!this.measure.active), 'false'),
      tool('surface', 'surface', kSurfaceLabel, () => this.showNext(), 'false'),
      this.settings.button, this.settings.element);
  }

  lookAtNewest() {
    this.select({ image: this.newest });
    this.viewer.controls.moved = true;
    this.viewer.lookAtCamera(this.newest);
  }

  fit() {
    this.setFollow(false);
    this.viewer.controls.moved = false;
    this.fittedCameras = this.fittedPoints = 0;
    this.viewer.fit();
    this.changed();
  }

  setFollow(on) {
    this.follow = on;
    byId('tool_follow').setAttribute('aria-pressed', String(on));
    if (!on) return;
    this.viewer.controls.moved = false;
    if (this.newest) this.viewer.followCamera(this.newest);
  }

  // Points, then the surface, then the mesh, of those that there are.
  showNext() {
    const kinds = this.kindsToShow();
    if (kinds.length === 1) return;
    this.wants = kinds[(kinds.indexOf(this.wants) + 1) % kinds.length];
    storeChoice('points', this.wants === 'points' ? null : this.wants);
    this.dense.follow(this.wants === 'surface');
    this.mesh.follow(this.wants === 'mesh');
    this.changed();
  }

  setFlying(on) {
    this.viewer.controls.flying = on;
    this.viewer.controls.moved = true;
    byId('tool_fly').setAttribute('aria-pressed', String(on));
    byId('canvas').classList.toggle('flying', on);
    if (on) byId('canvas').focus();
  }

  makeActions() {
    byId('mark').append(h('img', { src: '/assets/icon.svg', alt: '', width: 24, height: 24 }));
    byId('actions').append(
      this.inviteButton(),
      iconButton('theme', 'Dark or light', () => this.applyTheme(this.theme === 'dark' ? 'light' : 'dark', true), { id: 'theme_button' }),
      iconButton('help', 'Keys and help (?)', () => showHelp(this.session.version ?? '')));
  }

  inviteButton() {
    const button = iconButton('invite', 'Invite a phone or a person', () => showInvite({ agents: [...this.timeline.live.agents.keys()] }), { id: 'invite_button', hidden: true });
    button.append(h('span', {}, 'Invite'));
    return button;
  }

  applyTheme(theme, keep = false) {
    const system = systemTheme();
    this.theme = theme ?? system;
    document.documentElement.dataset.theme = this.theme;
    if (keep) storeChoice('theme', this.theme === system ? null : this.theme);
    this.viewer.setPaper(kPaper[this.theme], kGrid[this.theme]);
    this.changed();
  }

  shortcut(e) {
    if (e.ctrlKey || e.metaKey || e.altKey || byId('dialog').open) return;
    const typing = e.target.closest?.('input, select, textarea');
    const onButton = e.target.closest?.('button, a, summary, [role=tab]');
    if (typing) return;
    const actions = {
      f: () => this.fit(), n: () => this.setFollow(!this.follow), v: () => this.setFlying(!this.viewer.controls.flying),
      m: () => this.measure.setActive(!this.measure.active), p: () => this.showNext(), '?': () => showHelp(this.session.version ?? ''),
      Escape: () => (this.measure.active ? this.measure.setActive(false) : this.select(null)),
      ...(onButton ? {} : { ' ': () => this.timebar.toggle() }),
    };
    const action = actions[e.key.length === 1 ? e.key.toLowerCase() : e.key];
    if (!action) return;
    e.preventDefault();
    action();
  }

  // ---- for tests and the console

  describe() {
    const { shown, live } = this.timeline;
    const diagnoses = this.diagnoses();
    const { counts, notPlaced } = summarize(shown, diagnoses);
    return {
      dismissed: this.numDismissed(shown),
      session: this.feed.sessionId, head: live.head, shownHead: shown.head, isLive: this.timeline.isLive,
      connected: this.connection.connected, connections: this.numConnections, synced: this.feed.synced, counts, notPlaced,
      agents: [...shown.agents.values()].map((a) => ({ name: a.name, sent: a.sent })),
      submaps: liveSubmaps(shown).map((s) => ({ id: s.id, registered: s.numRegistered, state: s.state })),
      merges: [...shown.merges.values()].map(({ source, target, state }) => ({ source, target, state })),
      joining: [...this.world.joining.keys()], joined: this.world.joined,
      unplaced: [...shown.photos.values()].filter((p) => ['unplaced', 'failed'].includes(standingOf(shown, p, diagnoses).standing)).map((p) => p.id),
      points: this.viewer.submaps.numPoints, pointsShown: this.viewer.submaps.numPointsShown, loading: this.loading ?? 0,
      surface: {
        of: [...this.dense.submaps.keys()], on: this.viewer.submaps.showsSurfaces, loading: this.loadingDense ?? 0,
        points: this.viewer.submaps.numSurfacePoints, pointsShown: this.viewer.submaps.numSurfacePointsShown,
      },
      mesh: {
        of: [...this.mesh.submaps.keys()], on: this.viewer.submaps.showsMeshes, loading: this.loadingMesh ?? 0,
        triangles: this.viewer.submaps.numTriangles, trianglesShown: this.viewer.submaps.numTrianglesShown,
      },
      section: this.viewer.submaps.section,
      cameras: [...this.viewer.cameras.placed.keys()], shapes: [...this.world.shapes.keys()], selection: this.selection,
      stations: (this.stations ?? []).map(({ agent, number, from }) => ({ agent, number, from })),
      newest: this.newest, view: this.viewer.controls.describe(), framesDrawn: this.viewer.framesDrawn, finish: shown.finish,
      atRest: !this.updating && this.viewer.atRest,
    };
  }
}
