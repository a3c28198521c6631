// Scales from lengths that somebody knows: metres per unit of a submap's frame. Kept in this browser, session by session, so
// that a reload has them, and so do other pages of the same address.

const kPrefix = 'skein.scales.';

function browserStorage() {
  try {
    return globalThis.localStorage ?? null;
  } catch {
    return null; // storage may be forbidden
  }
}

// What another version, or somebody by hand, may have left there.
function parse(text) {
  try {
    const given = JSON.parse(text);
    return Array.isArray(given) ? given.filter((g) => Number.isFinite(g?.submap) && Number.isFinite(g.born) && Number.isFinite(g.metres) && g.metres > 0) : [];
  } catch {
    return [];
  }
}

export class Scales {
  constructor(storage = browserStorage()) {
    this.storage = storage;
    this.key = null;
    this.given = []; // {submap, born, metres}, the latest last. born: a submap that a repair made anew is another one
    this.kept = false; // in the browser
  }

  open(session) {
    this.key = kPrefix + session;
    this.given = [];
    this.read();
  }

  // key: of a browser's storage event. Returns whether scales have changed.
  heard(key) {
    if (this.key === null || (key !== this.key && key !== null)) return false;
    this.read();
    return true;
  }

  read() {
    try {
      const text = this.storage.getItem(this.key);
      this.given = parse(text ?? '[]');
      this.kept = true;
    } catch {
      this.kept = false;
    }
  }

  set({ id, born }, metres) {
    this.change([...this.given.filter((g) => g.submap !== id), { submap: id, born, metres }]);
  }

  // Of the map, and of those that it was joined from: else theirs would come back.
  forget(state, id) {
    this.change(this.given.filter((g) => !this.heirs(state, g).has(id)));
  }

  change(given) {
    this.given = given;
    try {
      if (given.length > 0) this.storage.setItem(this.key, JSON.stringify(given));
      else this.storage.removeItem(this.key);
      this.kept = true;
    } catch {
      this.kept = false; // then it lasts as long as the page
    }
  }

  // Metres per unit by submap id, the latest given one last. A map that was joined to another one gave it its scale.
  bySubmap(state) {
    const scales = new Map();
    for (const given of this.given) {
      for (const [id, metres] of this.heirs(state, given)) {
        scales.delete(id);
        scales.set(id, metres);
      }
    }
    return scales;
  }

  // One length's scale in the frames of its submap, and of all that this one was joined to.
  heirs(state, { submap, born, metres }) {
    const heirs = new Map();
    let now = state.submaps.get(submap);
    if (now?.born !== born) return heirs;
    heirs.set(now.id, metres);
    while (now?.mergedInto && !heirs.has(now.mergedInto)) {
      const { id, mergedInto } = now;
      const merge = [...state.merges.values()].find((m) => m.source === id && m.target === mergedInto && m.state === 'done' && m.similarity);
      if (!merge) break;
      metres /= merge.similarity[0]; // target_from_source: so many units of the target's frame are one of the source's
      heirs.set(mergedInto, metres);
      now = state.submaps.get(mergedInto);
    }
    return heirs;
  }
}
