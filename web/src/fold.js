// The session, folded from its events: a pure function of them. Live, late and replayed events give the
// same state. It mirrors libs/state/session/session_state.h, which is the authority on what facts come to.
//
// Times are utimes in microseconds, as in the events.

export function emptyState() {
  return {
    head: 0,
    utime: 0,
    firstUtime: 0,
    photos: new Map(), // by image id
    submaps: new Map(), // by submap id, ended ones included
    agents: new Map(), // by name, in order of their first photo
    merges: new Map(), // by merge id: ordered ones, with their latest state
    failedMerges: [], // attempts that found no similarity
    refused: [], // photos that were refused before they had an id
    edges: new Map(), // image id -> Map(other id -> inliers): verified pairs, both ways
    finish: null, // {finish, state, utime, cut, deadline: utime, 0: none} of the latest one
    newestPlaced: 0, // image id
  };
}

export function photoName(agent, name) {
  return agent ? `${agent}/${name}` : name;
}

function submapOf(state, id) {
  let submap = state.submaps.get(id);
  if (!submap) {
    submap = {
      id, state: 'seeded', photos: 0, points: 0, reason: '', mergedInto: 0, errorPx: null,
      expectedErrorPercent: null, ended: false, openMerge: 0, born: state.utime,
      trials: new Map(), // image id -> the latest word on it
      numRegistered: 0,
    };
    state.submaps.set(id, submap);
  }
  return submap;
}

function endSubmap(state, submap, reason, mergedInto) {
  submap.ended = true;
  submap.state = 'ended';
  submap.reason = reason || submap.reason;
  submap.mergedInto = mergedInto || submap.mergedInto;
  if (submap.openMerge) closeMerge(state, submap.openMerge);
}

// Either submap may be in a later merge by now.
function closeMerge(state, id) {
  const merge = state.merges.get(id);
  if (!merge) return;
  for (const submapId of [merge.source, merge.target]) {
    const submap = state.submaps.get(submapId);
    if (submap && submap.openMerge === id) submap.openMerge = 0;
  }
}

function addEdge(state, a, b, inliers) {
  for (const [from, to] of [[a, b], [b, a]]) {
    let others = state.edges.get(from);
    if (!others) state.edges.set(from, (others = new Map()));
    others.set(to, inliers);
  }
}

const folds = {
  photo(state, e) {
    const name = e.name ?? String(e.image);
    state.photos.set(e.image, {
      id: e.image, agent: e.agent ?? '', name, camera: e.camera, width: e.width, height: e.height,
      orientation: e.orientation ?? 1, bytes: e.bytes, focal: e.focal, captured: e.captured ?? 0,
      received: e.received || e.t, gps: e.gps ?? null,
      stored: e.t, described: 0, matched: 0, firstPlaced: 0,
      keypoints: null, numCandidates: null, numPairs: 0, describeS: null, matchS: null, placeS: null, failed: null,
    });
    let agent = state.agents.get(e.agent ?? '');
    if (!agent) {
      agent = { name: e.agent ?? '', index: state.agents.size, sent: 0, last: 0 };
      state.agents.set(agent.name, agent);
    }
    agent.sent++;
    agent.last = Math.max(agent.last, e.received || e.t);
    if (!state.firstUtime || (e.received || e.t) < state.firstUtime) state.firstUtime = e.received || e.t;
    // It came after all.
    state.refused = state.refused.filter((r) => !(r.cause === 'vanished' && r.agent === agent.name && r.name === name));
  },
  described(state, e) {
    const photo = state.photos.get(e.image);
    if (!photo) return;
    photo.described = e.t;
    photo.keypoints = e.keypoints;
    photo.describeS = e.s ?? null;
  },
  candidates(state, e) {
    const photo = state.photos.get(e.image);
    if (photo) photo.numCandidates = e.count ?? null;
  },
  matched(state, e) {
    for (const [other, inliers] of e.pairs ?? []) addEdge(state, e.image, other, inliers);
    const photo = state.photos.get(e.image);
    if (!photo) return;
    photo.matched = e.t;
    photo.matchS = e.s ?? null;
    photo.numPairs = (e.pairs ?? []).length;
  },
  registration(state, e) {
    const submap = submapOf(state, e.submap);
    const before = submap.trials.get(e.image)?.state === 'registered';
    const registered = e.state === 'registered';
    submap.trials.set(e.image, {
      state: e.state, cause: e.cause ?? 'other', reason: e.reason ?? '', pose: e.pose ?? null, inliers: e.inliers ?? 0,
      visible: e.visible ?? 0, errorPx: e.error_px ?? null, s: e.s ?? null, t: e.t,
    });
    submap.numRegistered += registered - before;
    const photo = state.photos.get(e.image);
    if (!photo || !registered) return;
    state.newestPlaced = e.image;
    if (!photo.firstPlaced) {
      photo.firstPlaced = e.t;
      photo.placeS = e.s ?? null;
    }
  },
  submap(state, e) {
    const submap = submapOf(state, e.submap);
    if (e.state === 'ended') {
      endSubmap(state, submap, e.reason, e.merged_into);
      return;
    }
    submap.state = e.state;
    if (e.photos !== undefined && e.state !== 'seeded') submap.photos = e.photos;
    if (e.points !== undefined) submap.points = e.points;
    if (e.error_px !== undefined) submap.errorPx = e.error_px;
    if (e.expected_error_percent !== undefined) submap.expectedErrorPercent = e.expected_error_percent;
  },
  merge(state, e) {
    const said = {
      id: e.merge, state: e.state, source: e.source, target: e.target,
      similarity: e.similarity ?? null, reason: e.reason ?? '', s: e.s ?? null, t: e.t,
    };
    if (e.state === 'failed') {
      state.failedMerges.push(said);
      return;
    }
    const earlier = state.merges.get(e.merge);
    state.merges.set(e.merge, {
      ...said, similarity: said.similarity ?? earlier?.similarity ?? null, ordered: earlier?.ordered ?? e.t,
    });
    if (e.state === 'ordered') {
      submapOf(state, e.source).openMerge = e.merge;
      submapOf(state, e.target).openMerge = e.merge;
    }
    if (e.state !== 'done' && e.state !== 'undone') return;
    closeMerge(state, e.merge);
    if (e.state === 'done') {
      endSubmap(state, submapOf(state, e.source), `merged into map ${e.target}`, e.target);
    }
  },
  failure(state, e) {
    if (!e.image) {
      state.refused.push({
        agent: e.agent ?? '', name: e.name ?? '', stage: e.stage ?? '', cause: e.cause ?? 'failed', reason: e.reason ?? '', t: e.t,
      });
      return;
    }
    const photo = state.photos.get(e.image);
    if (photo && e.parked !== false) photo.failed = { stage: e.stage ?? '', cause: e.cause ?? 'failed', reason: e.reason ?? '', t: e.t };
  },
  finish(state, e) {
    if (e.state === 'deadline' || e.state === 'cut') {
      const change = e.state === 'cut' ? { cut: true } : { deadline: e.deadline ?? 0 };
      if (state.finish) state.finish = { ...state.finish, ...change };
      return;
    }
    const { cut, deadline } = e.state === 'requested' ? e : state.finish ?? {};
    state.finish = { finish: e.finish, state: e.state, utime: e.t, cut: Boolean(cut), deadline: deadline ?? 0 };
  },
};

// Changes `state`. Events come in the order of seq; one that was folded already does nothing, and of an unknown
// kind only the place in the ledger is taken.
export function fold(state, event) {
  if (event.seq <= state.head) return state;
  state.head = event.seq;
  state.utime = Math.max(state.utime, event.t ?? 0);
  if (Object.hasOwn(folds, event.kind)) folds[event.kind](state, event);
  return state;
}

// The state at `utime`. Facts of one session are committed in order, so their times do not fall.
export function foldUpTo(events, utime) {
  const state = emptyState();
  for (const event of events) {
    if (event.t > utime) break;
    fold(state, event);
  }
  return state;
}

// The live submap that holds the photo, with what it says of it; null if none does. In a merge both may hold
// it for a moment: then the older one.
export function placeOf(state, imageId) {
  for (const submap of state.submaps.values()) {
    if (submap.ended) continue;
    const trial = submap.trials.get(imageId);
    if (trial?.state === 'registered') return { submap, trial };
  }
  return null;
}

const kNoDiagnoses = new Map();

// What the live submaps last said of a photo that none holds, the youngest submap first, as
// SessionState::WhyUnregistered.
function refusalOf(state, imageId) {
  for (const submap of [...state.submaps.values()].reverse()) {
    const trial = submap.ended ? undefined : submap.trials.get(imageId);
    if (trial && trial.reason) return { submap, trial };
  }
  return null;
}

export function bestLink(state, imageId) {
  let best = null;
  for (const [other, inliers] of state.edges.get(imageId) ?? []) {
    if (!best || inliers > best.inliers) best = { image: other, inliers };
  }
  return best;
}

// standing: 'placed', 'waiting' (in work, or its turn comes), 'unplaced' (tried in vain) or 'failed'. cause: of the last two, a key
// of words.js. reason: what a service says, or what is waited for. needsOthers: it waits for photos that are to be taken.
//
// diagnoses: image id -> diagnosis of the newest status message. They know more than events do, and phone and `skein status` tell
// the same; only of a place do events know sooner.
export function standingOf(state, photo, diagnoses = kNoDiagnoses) {
  const place = placeOf(state, photo.id);
  if (place) return { standing: 'placed', reason: '', ...place };
  if (photo.failed) return { standing: 'failed', ...photo.failed };
  const told = diagnoses.get(photo.id);
  if (told) return { ...refusalOf(state, photo.id), ...told, standing: told.cause === 'failed' ? 'failed' : 'unplaced' };
  if (!photo.described) return { standing: 'waiting', reason: 'waits for its features' };
  if (photo.keypoints === 0) return { standing: 'unplaced', cause: 'few details', reason: '', keypoints: 0 };
  if (!photo.matched) return { standing: 'waiting', reason: 'waits for its matches' };
  const refusal = refusalOf(state, photo.id);
  if (refusal) return { standing: 'unplaced', cause: refusal.trial.cause, reason: refusal.trial.reason, ...refusal };
  if (!state.edges.get(photo.id)?.size) {
    // There was nothing to compare it with, as of the first photo.
    if (photo.numCandidates === 0) return { standing: 'waiting', reason: 'waits for photos that overlap it', needsOthers: true };
    return { standing: 'unplaced', cause: 'no overlap', reason: '' };
  }
  const finishedSince = state.finish?.state === 'done' && state.finish.utime >= photo.matched;
  if (finishedSince) return { standing: 'unplaced', cause: state.finish.cut ? 'not in time' : 'weak overlap', reason: '' };
  return { standing: 'waiting', reason: 'waits for its place' };
}

// Photos that are not placed, the newest first, and then those that were refused before they had an id:
// [{key, photo or refused, standing}]. A key tells a photo from one that a repaired ledger numbers alike.
export function notPlacedOf(state, diagnoses = kNoDiagnoses) {
  const list = [];
  for (const photo of state.photos.values()) {
    const standing = standingOf(state, photo, diagnoses);
    if (standing.standing !== 'unplaced' && standing.standing !== 'failed') continue;
    list.push({ key: photoKey(photo), photo, standing });
  }
  list.reverse();
  for (const refused of state.refused) {
    list.push({ key: `r${refused.t}/${refused.agent}/${refused.name}`, refused, standing: { standing: 'failed', cause: refused.cause, reason: refused.reason } });
  }
  return list;
}

export const photoKey = ({ id, stored }) => `p${id}/${stored}`;

// Everything that is counted, in one pass over the photos. `received` holds refused ones, as report.json does. needOthers: of those
// that wait, how many wait for photos that are to be taken.
export function summarize(state, diagnoses = kNoDiagnoses) {
  const counts = {
    received: state.photos.size + state.refused.length,
    described: 0, matched: 0, placed: 0, waiting: 0, unplaced: 0, failed: state.refused.length,
  };
  const placedOf = new Map(); // agent -> photos placed
  const receivedOf = new Map(); // agent -> photos received, refused ones among them
  for (const { agent } of state.refused) receivedOf.set(agent, (receivedOf.get(agent) ?? 0) + 1);
  let needOthers = 0;
  const latencies = []; // {t, s} of the photos that were placed, by the time of their first place
  for (const photo of state.photos.values()) {
    counts.described += photo.described > 0;
    counts.matched += photo.matched > 0;
    const { standing, needsOthers = false } = standingOf(state, photo, diagnoses);
    counts[standing]++;
    needOthers += needsOthers;
    receivedOf.set(photo.agent, (receivedOf.get(photo.agent) ?? 0) + 1);
    if (standing === 'placed') placedOf.set(photo.agent, (placedOf.get(photo.agent) ?? 0) + 1);
    if (photo.firstPlaced) latencies.push({ t: photo.firstPlaced, s: (photo.firstPlaced - photo.received) / 1e6 });
  }
  latencies.sort((a, b) => a.t - b.t);
  return { counts, placedOf, receivedOf, latencies, needOthers, notPlaced: counts.unplaced + counts.failed };
}

export function liveSubmaps(state) {
  return [...state.submaps.values()].filter((s) => !s.ended);
}

// The submap that holds what `id` held: itself, or the last of those that it merged into.
export function heirOf(state, id) {
  const seen = new Set();
  let submap = state.submaps.get(id);
  while (submap?.mergedInto && !seen.has(submap.id)) {
    seen.add(submap.id);
    submap = state.submaps.get(submap.mergedInto);
  }
  return submap && !submap.ended ? submap.id : 0;
}

export function percentile(values, percent) {
  if (values.length === 0) return null;
  const sorted = [...values].sort((a, b) => a - b);
  const place = (percent / 100) * (sorted.length - 1);
  const low = Math.floor(place);
  const high = Math.ceil(place);
  return sorted[low] + (sorted[high] - sorted[low]) * (place - low);
}
