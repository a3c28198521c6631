import assert from 'node:assert/strict';
import { test } from 'node:test';
import { keyed, withCode } from '../src/ui/dom.js';
import { showDoor } from '../src/ui/door.js';
import { showTroubles } from '../src/ui/troubles.js';

// As much of a browser's elements as keyed() needs.
class FakeElement {
  children = [];
  parent = null;
  get firstChild() {
    return this.children[0] ?? null;
  }
  get nextSibling() {
    return this.parent.children[this.parent.children.indexOf(this) + 1] ?? null;
  }
  insertBefore(element, place) {
    element.remove();
    element.parent = this;
    this.children.splice(place ? this.children.indexOf(place) : this.children.length, 0, element);
  }
  remove() {
    if (this.parent) this.parent.children = this.parent.children.filter((e) => e !== this);
    this.parent = null;
  }
}

function show(list, items) {
  let made = 0;
  keyed(list, items, (item) => item.key, () => {
    made++;
    return new FakeElement();
  }, (element, item) => { element.text = item.text; });
  assert.deepEqual(list.children.map((e) => e.text), items.map((item) => item.text));
  return made;
}
const item = (key, text = key) => ({ key, text });

test('Elements are kept, moved, made and removed by key', () => {
  const list = new FakeElement();
  assert.equal(show(list, ['a', 'b', 'c'].map((k) => item(k))), 3);
  const [a, b, c] = list.children;
  assert.equal(show(list, ['c', 'a', 'd'].map((k) => item(k))), 1);
  assert.ok(list.children[0] === c && list.children[1] === a && b.parent === null);
  assert.equal(show(list, []), 0);
});

test('Two items with one key have an element each, and none is left behind', () => {
  const list = new FakeElement();
  assert.equal(show(list, [item('a', '1'), item('a', '2'), item('b')]), 3);
  const before = [...list.children];
  assert.equal(show(list, [item('a', '3'), item('a', '4'), item('b')]), 0);
  assert.deepEqual(list.children, before);
  show(list, [item('a', '5'), item('b')]);
  show(list, [item('b')]);
  show(list, []);
});

// Elements whose text can be read: '<code>' stands before what is code.
class TextElement extends FakeElement {
  constructor(tag) {
    super();
    Object.assign(this, { tag, dataset: {} });
  }
  append(...parts) {
    this.children.push(...parts.map((part) => (part instanceof FakeElement ? part : String(part))));
  }
  replaceChildren(...parts) {
    this.children = [];
    this.append(...parts);
  }
  get lastChild() {
    return this.children.at(-1);
  }
  setAttribute() {}
  get text() {
    return (this.tag === 'code' ? '<code>' : '') + this.children.map((c) => c.text ?? c).join('');
  }
}
globalThis.document = { createElement: (tag) => new TextElement(tag) };

test('A door without help says nothing in its place', () => {
  const door = new TextElement('div');
  showDoor(door, { title: 'No photos yet', what: 'Use `skein invite`.', help: '' });
  assert.deepEqual(door.children.map((c) => c.text), ['No photos yet', 'Use <code>skein invite.']);
  showDoor(door, { title: 'Moved', what: 'Away.', help: 'Follow.' });
  assert.deepEqual(door.children.map((c) => c.text), ['Moved', 'Away.', 'Follow.']);
});

test('What is between backticks is code; a remedy that changes is told anew', () => {
  assert.deepEqual(withCode('plain'), ['plain']);
  const list = new TextElement('ul');
  const words = () => list.children.map((row) => row.text);
  showTroubles(list, [{ what: 'It stands.', remedy: 'Start `skein launch`.' }]);
  assert.deepEqual([list.hidden, words()], [false, ['It stands. Start <code>skein launch.']]);
  showTroubles(list, [{ what: 'It stands.', remedy: 'Wait.' }]);
  assert.deepEqual(words(), ['It stands. Wait.']);
  showTroubles(list, []);
  assert.deepEqual([list.hidden, words()], [true, []]);
});
