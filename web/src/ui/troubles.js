// What a person has to mend ({what, remedy}, whole sentences of the session): a banner, in the session's words.
import { h, keyed, setText } from './dom.js';

export function showTroubles(list, troubles) {
  list.hidden = troubles.length === 0;
  keyed(list, troubles, (t) => t.what, () => h('li', {}, h('b'), ' ', h('span')), (row, { what, remedy }) => {
    const [whatPart, remedyPart] = row.children;
    setText(whatPart, what);
    setText(remedyPart, remedy);
  });
}
