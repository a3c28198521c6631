// Where each submap stands on the screen. Its own frame has any origin, direction and scale; the display's frame has
// +y up and the same size of a step between photos for each submap. Pure functions.
import { median } from './median.js';
import {
  add, apply, compose, distance, dot, eigenSymmetric, fitSimilarity, multiply, rotate, rotationBetween, scaled, subtract, unit,
} from './similarity.js';

// The direction that is up for who held the cameras. Their x axes are level, as a rule; their centres lie about in a
// plane; their -y axes point up on average. Minimizes
//   mean (u.x)^2 + 0.3 u^T C u / tr C - 0.15 (u.m)^2,  m the mean of the -y axes, C the covariance of the centres,
// and takes the sign from m, where that says nothing (photos from above) from the directions of view.
export function guessUp(places) {
  if (places.length === 0) return [0, -1, 0];
  const n = places.length;
  const A = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  const addOuter = (v, f) => {
    for (let r = 0; r < 3; ++r) for (let c = 0; c < 3; ++c) A[r][c] += f * v[r] * v[c];
  };
  let m = [0, 0, 0];
  let view = [0, 0, 0];
  let centre = [0, 0, 0];
  for (const place of places) {
    addOuter(rotate(place.worldFromCam, [1, 0, 0]), 1 / n);
    m = add(m, scaled(rotate(place.worldFromCam, [0, -1, 0]), 1 / n));
    view = add(view, scaled(rotate(place.worldFromCam, [0, 0, 1]), 1 / n));
    centre = add(centre, scaled(place.centre, 1 / n));
  }
  const spread = places.reduce((sum, p) => sum + distance(p.centre, centre) ** 2, 0);
  if (n >= 3 && spread > 0) for (const place of places) addOuter(subtract(place.centre, centre), 0.3 / spread);
  addOuter(m, -0.15);
  const up = unit(eigenSymmetric(A)[0].vector);
  const sign = dot(up, m) - 0.5 * dot(up, view);
  return sign < 0 ? scaled(up, -1) : up;
}

const metresPerDegree = (latitude) => [111132.95, 111319.49 * Math.cos((latitude * Math.PI) / 180)];

// Metres per unit and the direction up of photos with GPS; null where they don't determine it. Local coordinates:
// x east, y up, z south of the first photo, `origin`. Photos without altitude have no say where enough have one.
export function georeference(all) {
  const high = all.filter((p) => Number.isFinite(p.gps[2]));
  const photos = high.length >= 4 ? high : all;
  if (photos.length < 4) return null;
  const [lat0, lon0] = photos[0].gps;
  const alt0 = high.length >= 4 ? photos[0].gps[2] : 0;
  const [perLat, perLon] = metresPerDegree(lat0);
  const local = ({ gps: [lat, lon, alt] }) => [
    (lon - lon0) * perLon, high.length >= 4 ? alt - alt0 : 0, -(lat - lat0) * perLat,
  ];
  const fit = (chosen) => fitSimilarity(chosen.map(local), chosen.map((p) => p.centre));
  const errors = (m) => photos.map((p) => distance(apply(m, p.centre), local(p)));
  let m = fit(photos);
  if (!m) return null;
  // Once more without those that GPS placed elsewhere.
  const limit = 2.5 * Math.max(median(errors(m)), 0.01);
  const kept = photos.filter((p) => distance(apply(m, p.centre), local(p)) <= limit);
  m = (kept.length >= 4 && fit(kept)) || m;
  const error = median(errors(m));
  const extent = Math.max(...photos.map((p) => distance(local(p), local(photos[0]))));
  return extent > 4 * error && extent > 2 ? { localFromSubmap: m, error, extent, origin: { image: photos[0].image, gps: [lat0, lon0, high.length >= 4 ? alt0 : null] } } : null;
}

// Of a point of the submap, by `geo` of georeference(): metres from the origin, degrees, and the altitude where GPS has it.
export function coordinatesOf({ localFromSubmap, error, origin }, own) {
  const [x, y, z] = apply(localFromSubmap, own);
  const [lat0, lon0, alt0] = origin.gps;
  const [perLat, perLon] = metresPerDegree(lat0);
  const isHigh = alt0 !== null;
  return {
    east: x, north: -z, up: isHigh ? y : null, latitude: lat0 - z / perLat, longitude: lon0 + x / perLon, altitude: isHigh ? alt0 + y : null,
    error, from: origin.image,
  };
}

// What decides how a submap is shown. `photos`: [{centre, worldFromCam, gps?}], `points`: a sample of its points.
// `before`: of the same submap, whose heading is kept.
export function measureSubmap(photos, points, before = null) {
  const geo = georeference(photos.filter((p) => p.gps));
  const up = geo ? rotate(invertRotation(geo.localFromSubmap.q), [0, 1, 0]) : guessUp(photos);
  const centres = photos.map((p) => p.centre);
  const all = points.length >= 20 ? points : centres.concat(points);
  const middle = [0, 1, 2].map((k) => median(all.map((p) => p[k])));
  // A step: from a photo to its nearest neighbour.
  const sample = centres.length > 200 ? centres.filter((_, i) => i % Math.ceil(centres.length / 200) === 0) : centres;
  const steps = sample
    .map((c) => Math.min(...centres.filter((o) => o !== c).map((o) => distance(c, o))))
    .filter((d) => d > 0 && Number.isFinite(d));
  const reach = quantile(all.concat(centres).map((p) => distance(p, middle)), 0.9);
  const step = median(steps) || reach / 4 || 1;
  return { up, middle, step, reach, geo, heading: before?.heading ?? meanView(photos), floor: quantile(all.map((p) => dot(p, up)), 0.03) };
}

// Where the cameras look on average, in the submap's frame; zero where they look all around.
function meanView(photos) {
  const mean = scaled(photos.reduce((sum, p) => add(sum, rotate(p.worldFromCam, [0, 0, 1])), [0, 0, 0]), 1 / photos.length);
  return Math.hypot(...mean) > 0.25 ? mean : [0, 0, 0];
}

const invertRotation = ([w, x, y, z]) => [w, -x, -y, -z];

export function quantile(values, f) {
  if (values.length === 0) return 0;
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(f * sorted.length))];
}

// The submap on its own: up is +y, a step between photos is 1, its middle over the origin and its floor at y = 0.
// With a georeference north is -z, else that is where its cameras look.
export function standing({ up, middle, step, floor, geo, heading }) {
  const q = geo ? geo.localFromSubmap.q : facingAway(rotationBetween(up, [0, 1, 0]), heading);
  const s = 1 / step;
  const at = scaled(rotate(q, middle), s);
  return { s, q, t: [-at[0], -floor * s, -at[2]] };
}

// Turned about y so that `heading` goes to -z.
function facingAway(q, heading) {
  const [x, , z] = rotate(q, heading);
  if (Math.hypot(x, z) < 0.05) return q;
  const angle = Math.atan2(x, -z);
  return multiply([Math.cos(angle / 2), 0, Math.sin(angle / 2), 0], q);
}

// display_from_submap of each submap, side by side along +x from the first one. `submaps`: [{id, measure}], the one
// that stays where it is first.
export function sideBySide(submaps) {
  const places = new Map();
  let right = 0;
  submaps.forEach(({ id, measure }, i) => {
    const base = standing(measure);
    const radius = Math.max(measure.reach / measure.step, 1.5);
    const x = i === 0 ? 0 : right + 0.35 * (radius + 4) + radius;
    right = x + radius;
    places.set(id, { ...base, t: add(base.t, [x, 0, 0]) });
  });
  return places;
}

// Where a submap stands that is joined to another one: target_from_source goes in between.
export function joined(displayFromTarget, targetFromSource) {
  return compose(displayFromTarget, targetFromSource);
}
