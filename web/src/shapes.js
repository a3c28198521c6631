// The newest shape of each submap: its manifest, and the chunks whose version is another one. Old chunks stay until the
// new ones are there. Loads at most kAtOnce chunks at a time, and of each only the prefix that the budget allows.
import { decodeChunk, prefixBytes, shareWithin } from './chunk.js';

const kAtOnce = 4;
const kRetryMs = 1500;
const kVersionsTried = 3;
const kKeptTimes = 2; // of the points that the budget allows: a chunk with more is cut

// A form of shapes: where the server has them, and `checked`, which bounds what a page believes of a manifest and throws
// on what is none. dropsAbsent: whether a manifest that the server has no more ends the shape. isWhole: chunks have no
// prefixes, and none is taken but of the version that the manifest names. decode(bytes, points): a chunk with at most about as many points, `points` of them by the budget's count.
export const kSparse = {
  manifestPath: (submap) => `/api/submaps/${submap}`,
  chunkPath: (submap, chunk) => `/api/submaps/${submap}/chunks/${chunk}`,
  checked: checkedManifest,
  dropsAbsent: false,
};

export class Shapes {
  // on: {manifest(submap, manifest), chunk(submap, id, chunk, entry of the manifest), chunkGone(submap, id),
  //   chunkCut(submap, id, points), gone(submap), load(waiting)}
  // wants(submap, entry): whether a chunk is to be loaded; pump() asks again. follows: as follow().
  constructor(on, { fetch, setTimeout, budget = 2_000_000, form = kSparse, wants = () => true, follows = true } = {}) {
    Object.assign(this, { on, form, wants, follows });
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

  // While it does not follow, it notes what is announced and asks for nothing.
  follow(on) {
    if (on === this.follows) return;
    this.follows = on;
    if (!on) return;
    for (const [id, submap] of this.submaps) {
      if (!submap.fetching && submap.wanted > (submap.manifest?.version ?? -1)) this.fetchManifest(id, submap);
    }
    this.pump();
  }

  // After a new connection: what was announced before may be no more. The server announces what there is.
  doubt() {
    for (const id of [...this.submaps.keys()]) {
      if (this.follows) this.announce(id, 0);
      else this.drop(id);
    }
  }

  // What was loaded of a submap is lost: it is loaded anew.
  again(id) {
    const wanted = this.submaps.get(id)?.wanted;
    if (wanted === undefined) return;
    this.drop(id);
    this.announce(id, wanted);
  }

  drop(id) {
    if (!this.submaps.delete(id)) return;
    this.on.gone(id);
    this.pump();
  }

  setBudget(points) {
    this.budget = points;
    this.cut();
    this.pump();
  }

  // The share of each chunk's points that the budget allows.
  get share() {
    let total = 0;
    for (const [id, { manifest }] of this.submaps) {
      for (const chunk of manifest?.chunks ?? []) if (this.wants(id, chunk)) total += chunk.points;
    }
    return shareWithin(this.budget, total);
  }

  // Chunks that were loaded when there were fewer keep about what the budget allows now.
  cut() {
    const { share } = this;
    for (const [id, { manifest, loaded }] of this.submaps) {
      for (const chunk of manifest?.chunks ?? []) {
        const have = loaded.get(chunk.id);
        const wanted = Math.ceil(share * chunk.points);
        if (!have || have.points <= kKeptTimes * wanted) continue;
        have.points = wanted;
        this.on.chunkCut?.(id, chunk.id, wanted);
      }
    }
  }

  async fetchManifest(id, submap) {
    if (!this.follows) return;
    const { generation } = this;
    submap.fetching = true;
    submap.retry = false;
    const wanted = submap.wanted;
    let manifest = null;
    let absent = false;
    try {
      const answer = await this.fetch(this.form.manifestPath(id), { cache: 'no-store' });
      if (answer.ok) manifest = this.form.checked(await answer.json());
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
      this.cut();
      this.pump();
    }
    // What was told meanwhile. A server that began anew may have older ones than were told before.
    if (submap.wanted > Math.max(wanted, manifest?.version ?? 0)) this.fetchManifest(id, submap);
    else if (absent && this.form.dropsAbsent) this.drop(id);
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
    if (this.missingOf(id, submap).length > 0 || submap.loading.size > 0) return;
    const present = new Set(submap.manifest.chunks.map((c) => c.id));
    for (const chunk of [...submap.loaded.keys()]) {
      if (present.has(chunk)) continue;
      submap.loaded.delete(chunk);
      this.on.chunkGone(id, chunk);
    }
  }

  missingOf(id, submap) {
    if (!submap.manifest) return [];
    const share = this.share;
    return submap.manifest.chunks.filter((chunk) => {
      if (submap.loading.has(chunk.id) || !this.wants(id, chunk)) return false;
      const have = submap.loaded.get(chunk.id);
      const isIt = have && (have.version === chunk.version || have.asked === chunk.version);
      return !isIt || have.points < 0.8 * Math.ceil(share * chunk.points);
    });
  }

  pump() {
    if (!this.follows) {
      this.on.load?.(this.active);
      return;
    }
    let waiting = 0;
    for (const [id, submap] of this.submaps) {
      for (const chunk of this.missingOf(id, submap)) {
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
  async fetchChunk(id, submap, entry) {
    const { generation } = this;
    const { id: chunkId, version, points } = entry;
    const wanted = Math.ceil(this.share * points);
    submap.loading.add(chunkId);
    this.active++;
    let chunk = null;
    let newer = version;
    try {
      for (let tries = this.form.isWhole ? 1 : kVersionsTried; !chunk && newer && tries > 0; --tries) {
        const headers = wanted < points && !this.form.isWhole ? { Range: `bytes=0-${prefixBytes(wanted) - 1}` } : {};
        const answer = await this.fetch(`${this.form.chunkPath(id, chunkId)}?v=${newer}`, { headers });
        if (answer.ok) chunk = (this.form.decode ?? decodeChunk)(await answer.arrayBuffer(), wanted);
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
      this.on.chunk(id, chunkId, chunk, entry);
      this.dropAbsent(id, submap);
    } else {
      this.retryLater(id, submap); // with the manifest of then
    }
    this.pump();
  }
}

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
