// What the guide says (a status' guidance and advice), as far as it fits what is shown. It is of the present alone.
import * as sim from './similarity.js';

const isArray = (a, n) => Array.isArray(a) && a.length === n && a.every(Number.isFinite);

// {guidance, advice}: of maps that live.
export function guidanceOf({ status, timeline }) {
  if (!timeline.isLive) return { guidance: [], advice: [] };
  const isLive = (id) => timeline.live.submaps.get(id)?.ended === false;
  const of = (list) => (Array.isArray(list) ? list.filter((entry) => isLive(entry.submap)) : []);
  return {
    guidance: of(status?.guidance).filter((g) => Number.isFinite(g.good_share)),
    advice: of(status?.advice).map((a) => ({ ...a, stations: Array.isArray(a.stations) ? a.stations : [] })),
  };
}

// Photos to take as cameras: [{agent, submap, number: from 1, from: the photo to start from, centre, worldFromCam, aspect}].
// aspectOf(submap, image): of a photo's camera, null where it is not known.
export function stationCameras(advice, aspectOf) {
  const cameras = [];
  for (const { agent, submap, last_photo: last, stations } of advice) {
    stations.forEach((station, i) => {
      const aspect = aspectOf(submap, last) ?? aspectOf(submap, station.nearest);
      if (!aspect || !isArray(station.pose, 7)) return;
      cameras.push({ agent, submap, number: i + 1, from: station.nearest, ...sim.cameraPlace(station.pose), aspect });
    });
  }
  return cameras;
}
