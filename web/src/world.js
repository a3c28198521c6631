// What the viewer is given: the shown state of the session and the newest shapes of its submaps, as places, cameras,
// colours and links.
import { agentColour, mapColour, rgb } from './colours.js';
import { photoPlaces, projectPoint } from './dense.js';
import { heirOf, liveSubmaps, placeOf } from './fold.js';
import { coordinatesOf, joined, measureSubmap, sideBySide } from './frames.js';
import { stationCameras } from './guidance.js';
import { framePlace } from './mesh.js';
import { prepareCameras, ranksOf } from './reveal.js';
import * as sim from './similarity.js';

const kMeasureAgain = 1.6; // times as many photos
const kJoinS = 8; // after which a joined submap goes, whatever its target's shape says
const kMapTint = 0.42;

export class World {
  constructor(viewer, timeline) {
    this.viewer = viewer;
    this.timeline = timeline;
    this.reset();
  }

  reset() {
    for (const id of this.shapes?.keys() ?? []) this.viewer.submaps.drop(id);
    this.shapes = new Map(); // submap id -> {manifest, cameras: Map(image -> {centre, worldFromCam, aspect})}
    this.dense = new Map(); // submap id -> manifest of its surface, as checkedDense() has it
    this.surfacesAt = null; // utime of the photos whose surfaces are shown; null: now
    this.measures = new Map(); // submap id -> {measure, photos}
    this.joining = new Map(); // source id -> {target, targetFromSource, photos, until, arrived, sent}
    this.joined = []; // ids of sources that were seen moving into their targets
  }

  setManifest(id, manifest) {
    const cameras = new Map();
    for (const photo of manifest.photos) {
      cameras.set(photo.image, { ...sim.cameraPlace(photo.pose), aspect: aspectOf(manifest.cameras[photo.camera]) });
    }
    this.keepStill(id, cameras);
    this.shapes.set(id, { manifest, cameras });
    for (const [source, join] of this.joining) {
      if (join.target === id && [...join.photos].some((image) => cameras.has(image))) join.arrived = true;
    }
    this.placeSurface(id);
    this.placeMesh(id);
  }

  // ---- surfaces

  // An adjustment may move the submap's whole frame: the mesh goes with the photos.
  placeMesh(id) {
    this.viewer.submaps.placeMesh(id, (frame) => this.framePlaceOf(id, frame));
  }

  setMeshChunk(id, chunkId, chunk, frame) {
    this.viewer.submaps.setMeshChunk(id, chunkId, chunk, frame, this.framePlaceOf(id, frame));
  }

  framePlaceOf(id, frame) {
    return framePlace(frame, this.shapes.get(id)?.cameras ?? new Map());
  }

  setDense(id, manifest) {
    this.dense.set(id, manifest);
    this.placeSurface(id);
  }

  dropDense(id) {
    this.dense.delete(id);
    this.viewer.submaps.dropSurface(id);
  }

  // Whether a photo has a place in the submap: without one its surface cannot be shown.
  hasPose(id, image) {
    return Boolean(this.shapes.get(id)?.cameras.has(image));
  }

  placeSurface(id) {
    const dense = this.dense.get(id);
    const shape = this.shapes.get(id);
    if (dense && shape) this.viewer.submaps.setPhotos(id, photoPlaces(dense, shape.cameras, (image) => this.isPlaced(image)));
  }

  // At the time that is shown.
  isPlaced(image) {
    const { timeline } = this;
    return timeline.isLive || (timeline.live.photos.get(image)?.firstPlaced || Infinity) <= timeline.utime;
  }

  // Surfaces of the photos that are placed at the time that is shown.
  showSurfaces() {
    if (this.surfacesAt === this.timeline.utime) return;
    this.surfacesAt = this.timeline.utime;
    for (const id of this.dense.keys()) this.placeSurface(id);
  }

  // Where a photo shows a point of its submap's frame: [{image, x, y}] in px of the stored photo; none where it does not.
  sightingsOf(id, image, own) {
    const manifest = this.shapes.get(id)?.manifest;
    const photo = manifest?.photos.find((p) => p.image === image);
    const camera = manifest?.cameras[photo?.camera];
    const at = camera && projectPoint(photo.pose, camera, own);
    return at?.every(Number.isFinite) ? [{ image, x: at[0], y: at[1] }] : [];
  }

  // ---- places

  // An adjustment may move a submap's whole frame. What is seen stays where it is.
  keepStill(id, cameras) {
    const old = this.shapes.get(id)?.cameras;
    const place = this.viewer.submaps.goalOf(id);
    if (!old || !place) return;
    const common = [...old.keys()].filter((image) => cameras.has(image));
    const oldFromNew = sim.fitSimilarity(
      common.map((image) => old.get(image).centre), common.map((image) => cameras.get(image).centre));
    if (!oldFromNew) return;
    const reach = this.measures.get(id)?.measure.reach ?? 1;
    const moved = Math.abs(Math.log(oldFromNew.s)) > 0.04 || Math.abs(oldFromNew.q[0]) < Math.cos(0.03) ||
      Math.hypot(...oldFromNew.t) > 0.05 * reach;
    if (!moved) return;
    this.measures.delete(id);
    this.viewer.submaps.setPlace(id, sim.compose(place, oldFromNew), { animate: false });
  }

  // Returns whether it went.
  dropShape(id) {
    if (this.joining.has(id)) return false; // it is still on its way into another one
    this.shapes.delete(id);
    this.measures.delete(id);
    this.viewer.submaps.drop(id);
    return true;
  }

  // The source's points and cameras move to where the target has them.
  join({ source, target, similarity }, now) {
    const targetFromSource = sim.fromArray(similarity);
    if (!targetFromSource || !this.viewer.submaps.placeOf(source) || !this.viewer.submaps.placeOf(target)) return false;
    this.joining.set(source, {
      target, targetFromSource, photos: new Set(this.shapes.get(source)?.cameras.keys() ?? []),
      until: now + kJoinS, arrived: false, sent: false,
    });
    return true;
  }

  // Submaps whose joining is over by now.
  takeJoined(now) {
    const over = [];
    for (const [source, join] of this.joining) {
      if ((join.arrived && join.sent && !this.viewer.submaps.isMoving(source)) || now > join.until) over.push(source);
    }
    for (const source of over) {
      this.joining.delete(source);
      this.joined.push(source);
      this.dropShape(source);
    }
    return over;
  }

  // Photos of a submap with their places in its frame: of its newest shape, else of the registrations.
  photosOf(submap) {
    const shape = this.shapes.get(submap.id);
    const { photos } = this.timeline.live;
    if (shape && shape.cameras.size > 0) {
      return [...shape.cameras].map(([image, c]) => ({ ...c, image, gps: photos.get(image)?.gps ?? null }));
    }
    const found = [];
    for (const [image, trial] of submap.trials) {
      if (trial.state !== 'registered' || !isPose(trial.pose)) continue;
      found.push({ ...sim.cameraPlace(trial.pose), image, gps: photos.get(image)?.gps ?? null });
    }
    return found;
  }

  place() {
    const standing = [];
    for (const submap of liveSubmaps(this.timeline.live)) {
      const known = this.measures.get(submap.id);
      const count = this.shapes.get(submap.id)?.cameras.size || submap.numRegistered;
      const points = this.viewer.submaps.samplePoints(submap.id, 800);
      const again = !known || count >= kMeasureAgain * known.photos || (known.points < 20 && points.length >= 20);
      if (again && count >= 2) {
        const photos = this.photosOf(submap);
        if (photos.length >= 2) {
          const measure = measureSubmap(photos, points, known?.measure);
          this.measures.set(submap.id, { measure, photos: photos.length, points: points.length });
        }
      }
      const entry = this.measures.get(submap.id);
      if (entry) standing.push({ id: submap.id, measure: entry.measure });
    }
    for (const [id, place] of sideBySide(standing)) {
      this.viewer.submaps.setPlace(id, place, { pivot: this.measures.get(id).measure.middle });
    }
    for (const [source, join] of this.joining) {
      const { target, targetFromSource } = join;
      join.sent = true;
      const goal = this.viewer.submaps.goalOf(target);
      const pivot = this.measures.get(source)?.measure.middle;
      if (goal) this.viewer.submaps.setPlace(source, joined(goal, targetFromSource), { pivot });
    }
  }

  // Depth of a frustum in the display: in step with the distances between photos and with the whole.
  cameraBase() {
    let reach = 0;
    for (const { measure } of this.measures.values()) reach = Math.max(reach, measure.reach / measure.step);
    return Math.min(2.5, Math.max(0.42, 0.045 * reach));
  }

  // Metres per unit of the display, where GPS tells; of the submap that holds most photos.
  metresPerUnit() {
    let best = null;
    for (const [id, { measure, photos }] of this.measures) {
      const place = this.viewer.submaps.goalOf(id);
      if (!measure.geo || !place || (best && best.photos >= photos)) continue;
      best = { photos, metres: measure.geo.localFromSubmap.s / place.s, error: measure.geo.error };
    }
    return best;
  }

  // Of a point in a submap's frame: coordinatesOf(); null where GPS does not tell.
  coordinatesOf(submap, own) {
    const geo = this.measures.get(submap)?.measure.geo;
    return geo ? coordinatesOf(geo, own) : null;
  }

  // Whether north is -z in the display: of each map that is shown.
  knowsNorth() {
    return this.measures.size > 0 && [...this.measures.values()].every(({ measure }) => measure.geo);
  }

  // Where a photo of the shown state stands: {submap, centre, worldFromCam, aspect} in the frame of a submap that the
  // viewer has.
  cameraOf(photo, submapId, trial) {
    for (const [source, join] of this.joining) {
      const camera = join.photos.has(photo.id) && this.shapes.get(source)?.cameras.get(photo.id);
      if (camera) return { submap: source, ...camera };
    }
    const { live } = this.timeline;
    const heir = heirOf(live, submapId);
    const today = heir && this.shapes.get(heir)?.cameras.get(photo.id);
    if (today) return { submap: heir, ...today };
    if (!isPose(trial.pose) || !heir) return null;
    let camera = { ...sim.cameraPlace(trial.pose), aspect: aspectOf(photo) };
    for (let at = submapId; at !== heir;) {
      const next = live.submaps.get(at).mergedInto;
      const merge = [...live.merges.values()].find((m) => m.source === at && m.target === next && m.state === 'done');
      const step = sim.fromArray(merge?.similarity);
      if (!step) return null;
      camera = {
        ...camera, centre: sim.apply(step, camera.centre), worldFromCam: sim.multiply(step.q, camera.worldFromCam),
      };
      at = next;
    }
    return { submap: heir, ...camera };
  }

  // Gives the viewer the cameras of the shown state. Returns the images that have one.
  showCameras({ theme, selected, newest }) {
    const { shown } = this.timeline;
    const cameras = [];
    for (const photo of shown.photos.values()) {
      const place = placeOf(shown, photo.id);
      const camera = place && this.cameraOf(photo, place.submap.id, place.trial);
      if (!camera) continue;
      const emphasis = photo.id === selected ? 2 : photo.id === newest ? 1 : 0;
      const colour = rgb(agentColour(theme, shown.agents.get(photo.agent)?.index ?? 0));
      cameras.push({ image: photo.id, ...camera, colour, emphasis, alpha: selected && !emphasis ? 0.55 : 0.9 });
    }
    this.viewer.cameras.set(cameras);
    return cameras;
  }

  // Photos that the guide advises, each with the way from the photo to start from.
  showStations({ theme, advice }) {
    const { shown } = this.timeline;
    const aspect = (submap, image) => this.shapes.get(submap)?.cameras.get(image)?.aspect ?? null;
    const stations = stationCameras(advice, aspect).map((station) => ({
      ...station, colour: rgb(agentColour(theme, shown.agents.get(station.agent)?.index ?? 0)), alpha: station.number === 1 ? 1 : 0.5,
    }));
    this.viewer.cameras.setStations(stations);
    return stations;
  }

  // The points of an earlier time. Ranks are computed a chunk at a time; returns whether some are still to come.
  showRanks() {
    const { timeline, viewer } = this;
    let left = false;
    for (const [id, { manifest, cameras }] of this.shapes) {
      if (timeline.isLive || viewer.submaps.showsSurface(id)) {
        viewer.submaps.setRank(id, null);
        continue;
      }
      const order = [...cameras.keys()]
        .map((image) => ({ image, t: timeline.live.photos.get(image)?.firstPlaced || Infinity }))
        .sort((a, b) => a.t - b.t);
      const [points] = viewer.submaps.unranked(id);
      if (points) {
        if (this.prepared?.manifest !== manifest) {
          const inOrder = order.map(({ image }) => cameras.get(image));
          this.prepared = { manifest, cameras: prepareCameras(inOrder, viewer.submaps.samplePoints(id, 4000)) };
        }
        points.setRanks(ranksOf(points.chunk, this.prepared.cameras, points.shown));
        left ||= viewer.submaps.unranked(id).length > 0;
      }
      viewer.submaps.setRank(id, order.filter(({ t }) => t <= timeline.utime).length);
    }
    return left;
  }

  showTints(theme, wanted) {
    const several = wanted && this.measures.size > 1;
    for (const id of this.viewer.submaps.ids()) {
      this.viewer.submaps.setTint(id, mapColour(theme, id), several ? kMapTint : 0);
    }
  }

  // Lines from a photo to those that it shares points with; the more, the stronger.
  showLinks(image, colourOf) {
    const edges = [...(this.timeline.shown.edges.get(image) ?? [])].sort((a, b) => b[1] - a[1]).slice(0, 40);
    const most = edges.length ? edges[0][1] : 1;
    this.viewer.cameras.setLinks(edges.map(([other, inliers]) => ({
      from: image, to: other, colour: [...colourOf, 0.25 + 0.75 * (inliers / most)],
    })));
  }
}

const isPose = (pose) => Array.isArray(pose) && pose.length === 7 && pose.every(Number.isFinite);

// Tangents of half the angles of view. `camera`: a manifest's or a photo.
function aspectOf(camera) {
  const width = camera?.width || 4;
  const height = camera?.height || 3;
  const fx = camera?.fx || camera?.focal || 1.2 * Math.max(width, height);
  const fy = camera?.fy || fx;
  return [width / (2 * fx), height / (2 * fy)];
}
