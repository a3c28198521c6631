// The newest shape of each submap: its manifest, and the chunks whose version is another one. Old chunks stay until the
// new ones are there. Loads at most kAtOnce chunks at a time, and of each only the prefix that the budget allows.
import { decodeChunk, prefixBytes } from './chunk.js';

const kAtOnce = 4;
const kRetryMs = 1500;
const kVersionsTried = 3;

export class Shapes {
  // on: {manifest(submap, manifest), chunk(submap, id, chunk), chunkGone(submap, id), gone(submap), load(waiting)}
  constructor(on, { fetch, setTimeout, budget = 2_000_000 } = {}) {
    this.on = on;
    this.fetch = fetch ?? globalThis.fetch.bind(globalThis);
    this.setTimeout = setTimeout ?? globalThis.setTimeout.bind(globalThis);
    this.budget = budget;
    this.submaps = new Map(); // id -> {manifest, wanted, fetching, retry, loaded: Map(chunk id -> {asked, version, points})}
    this.active = 0;
    this.generation = 0;
  }

  reset() {
    this.generation++;
    for (const id of [...this.submaps.keys()]) this.drop(id);
  }

  // The submap has a shape of this version; 0: it may have one.
  announce(id, version = 0) {
    let submap = this.submaps.get(id);
    if (!submap) {
      submap = { manifest: null, wanted: -1, fetching: false, retry: false, loaded: new Map(), loading: new Set() };
      this.submaps.set(id, submap);
    }
    if (submap.manifest && version !== 0 && version <= submap.manifest.version) return;
    submap.wanted = Math.max(submap.wanted, version);
    if (!submap.fetching) this.fetchManifest(id, submap);
  }

  drop(id) {
    if (!this.submaps.delete(id)) return;
    this.on.gone(id);
    this.pump();
  }

  setBudget(points) {
    this.budget = points;
    this.pump();
  }

  // The share of each chunk's points that the budget allows.
  get share() {
    let total = 0;
    for (const { manifest } of this.submaps.values()) {
      for (const chunk of manifest?.chunks ?? []) total += chunk.points;
    }
    return total > this.budget ? this.budget / total : 1;
  }

  async fetchManifest(id, submap) {
    const { generation } = this;
    submap.fetching = true;
    submap.retry = false;
    const wanted = submap.wanted;
    let manifest = null;
    let absent = false;
    try {
      const answer = await this.fetch(`/api/submaps/${id}`, { cache: 'no-store' });
      if (answer.ok) manifest = checkedManifest(await answer.json());
      absent = answer.status === 404;
    } catch {
      // The connection is lost, or will be told to be: the next shape or the retry goes on.
    }
    submap.fetching = false;
    if (generation !== this.generation || this.submaps.get(id) !== submap) return;
    if (manifest) {
      submap.manifest = manifest;
      this.on.manifest(id, manifest);
      this.dropAbsent(id, submap);
      this.pump();
    }
    // What was told meanwhile. A server that began anew may have older ones than were told before.
    if (submap.wanted > Math.max(wanted, manifest?.version ?? 0)) this.fetchManifest(id, submap);
    else if (!manifest && !absent) this.retryLater(id, submap);
  }

  retryLater(id, submap) {
    if (submap.retry) return;
    submap.retry = true;
    this.setTimeout(() => {
      if (this.submaps.get(id) !== submap || !submap.retry) return;
      submap.retry = false;
      // A manifest that is on its way asks for what is missing when it comes.
      if (!submap.fetching) this.fetchManifest(id, submap);
    }, kRetryMs);
  }

  // Chunks that the newest shape has no more go when all that it has are there, so that no hole is seen.
  dropAbsent(id, submap) {
    if (this.missingOf(submap).length > 0 || submap.loading.size > 0) return;
    const present = new Set(submap.manifest.chunks.map((c) => c.id));
    for (const chunk of [...submap.loaded.keys()]) {
      if (present.has(chunk)) continue;
      submap.loaded.delete(chunk);
      this.on.chunkGone(id, chunk);
    }
  }

  missingOf(submap) {
    if (!submap.manifest) return [];
    const share = this.share;
    return submap.manifest.chunks.filter((chunk) => {
      if (submap.loading.has(chunk.id)) return false;
      const have = submap.loaded.get(chunk.id);
      const isIt = have && (have.version === chunk.version || have.asked === chunk.version);
      return !isIt || have.points < 0.8 * Math.ceil(share * chunk.points);
    });
  }

  pump() {
    let waiting = 0;
    for (const [id, submap] of this.submaps) {
      for (const chunk of this.missingOf(submap)) {
        if (this.active >= kAtOnce || submap.retry) {
          waiting++;
          continue;
        }
        this.fetchChunk(id, submap, chunk);
      }
    }
    this.on.load?.(waiting + this.active);
  }

  // A version that is gone was followed by a newer one, which the answer tells: then that one is fetched.
  async fetchChunk(id, submap, { id: chunkId, version, points }) {
    const { generation } = this;
    const wanted = Math.ceil(this.share * points);
    submap.loading.add(chunkId);
    this.active++;
    let chunk = null;
    let newer = version;
    try {
      for (let tries = 0; !chunk && newer && tries < kVersionsTried; ++tries) {
        const headers = wanted < points ? { Range: `bytes=0-${prefixBytes(wanted) - 1}` } : {};
        const answer = await this.fetch(`/api/submaps/${id}/chunks/${chunkId}?v=${newer}`, { headers });
        if (answer.ok) chunk = decodeChunk(await answer.arrayBuffer());
        else newer = answer.status === 404 ? Number((await answer.json()).version) : 0;
      }
    } catch {
      chunk = null;
    }
    this.active--;
    submap.loading.delete(chunkId);
    if (generation !== this.generation || this.submaps.get(id) !== submap) {
      this.pump();
      return;
    }
    if (chunk) {
      submap.loaded.set(chunkId, { asked: version, version: newer, points: chunk.points });
      this.on.chunk(id, chunkId, chunk);
      this.dropAbsent(id, submap);
    } else {
      this.retryLater(id, submap); // with the manifest of then
    }
    this.pump();
  }
}

// Bounds what a page believes; throws on what is no manifest.
function checkedManifest(manifest) {
  if (!Array.isArray(manifest.photos) || !Array.isArray(manifest.chunks) || typeof manifest.cameras !== 'object') {
    throw new Error('not a shape of a submap');
  }
  const isPose = (p) => Array.isArray(p) && p.length === 7 && p.every(Number.isFinite);
  return {
    ...manifest,
    version: Number(manifest.version) || 0,
    photos: manifest.photos.filter((p) => isPose(p.pose)),
    chunks: manifest.chunks.filter((c) => Number.isInteger(c.id) && c.points > 0),
  };
}
