// The door: what stands in the way, in place of the page. The element stays as it is while that is the same.
import { h, withCode } from './dom.js';

// role: 'status' where nothing is wrong.
export function showDoor(element, { title, what, help }, role = 'alert') {
  element.hidden = false;
  const told = JSON.stringify([role, title, what, help]);
  if (element.dataset.door === told) return;
  element.dataset.door = told;
  element.replaceChildren(h('h2', {}, title), h('p', { role }, withCode(what)), ...(help ? [h('p', {}, help)] : []));
}
