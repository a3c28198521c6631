// Scales from lengths that somebody knows: metres per unit of a submap's frame. Kept in this browser, session by session.
import { Kept } from './kept.js';

const isSound = (g) => Number.isFinite(g?.submap) && Number.isFinite(g.born) && Number.isFinite(g.metres) && g.metres > 0;

// {submap, born, metres}, the latest last. born: a submap that a repair made anew is another one
export class Scales extends Kept {
  constructor(storage) {
    super('skein.scales.', isSound, storage);
  }

  set({ id, born }, metres) {
    this.change([...this.list.filter((g) => g.submap !== id), { submap: id, born, metres }]);
  }

  // Of the map, and of those that it was joined from: else theirs would come back.
  forget(state, id) {
    this.change(this.list.filter((g) => !this.heirs(state, g).has(id)));
  }

  // Metres per unit by submap id, the latest given one last. A map that was joined to another one gave it its scale.
  bySubmap(state) {
    const scales = new Map();
    for (const given of this.list) {
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
