// Photos that are not placed, and that somebody said "I know" of: they count no more. That is no fact of the session: it says
// what one person needs to be told, changes no map, and another person decides anew. So it is kept in the browser.
import { photoKey, placeOf } from './fold.js';
import { Kept } from './kept.js';

// By the keys of notPlacedOf().
export class Dismissed extends Kept {
  constructor(storage) {
    super('skein.dismissed.', (key) => typeof key === 'string', storage);
  }

  has(key) {
    return this.list.includes(key);
  }

  set(key, on) {
    if (this.has(key) !== on) this.change(on ? [...this.list, key] : this.list.filter((k) => k !== key));
  }

  // A photo that is placed after all counts again if it leaves its map.
  forgetPlaced(state) {
    const left = this.list.filter((key) => !isPlaced(state, key));
    if (left.length < this.list.length) this.change(left);
  }
}

function isPlaced(state, key) {
  const photo = state.photos.get(Number(/^p(\d+)\//.exec(key)?.[1]));
  return Boolean(photo && photoKey(photo) === key && placeOf(state, photo.id));
}
