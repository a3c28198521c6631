// What a person has to mend ({what, remedy}, whole sentences of the session): a banner, in the session's words.
import { h, keyed, withCode } from './dom.js';

export function showTroubles(list, troubles) {
  list.hidden = troubles.length === 0;
  keyed(list, troubles, (t) => t.what, () => h('li', {}, h('b'), ' ', h('span')), (row, { what, remedy }) => {
    if (row.dataset.told === what + remedy) return;
    row.dataset.told = what + remedy;
    row.firstChild.replaceChildren(...withCode(what));
    row.lastChild.replaceChildren(...withCode(remedy));
  });
}
