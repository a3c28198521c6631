import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { doorOf, keepsNothing, kUnreachable } from '../src/door.js';

const sources = ['libs/net/auth/web_pass.cc', 'libs/view/http/guests.cc', 'libs/view/http/access.cc']
  .map((path) => readFileSync(new URL(`../../${path}`, import.meta.url), 'utf8').replace(/"\s*\n\s*"/g, '')).join('\n');

// What the server says, as its source has it, and the title that a visitor reads.
const kSaid = [
  ['this invitation was revoked', 'Invitation revoked'],
  ['this invitation has expired: ask for another', 'Invitation expired'],
  ['this invitation is cut or damaged: open the whole link again', 'Invitation damaged'],
  ['this invitation is for another session: ask for one of this session', 'Invitation for another session'],
  ['open the link of your invitation; who runs the session makes one with `skein invite`', 'Invitation needed'],
  ["it is for sending photos and seeing one's own", 'This invitation sends photos'],
  ['it is for looking; ask for one for an agent', 'This invitation is for looking'],
  ["open the view by the server's address, ", 'Another address is needed'],
];

test('Each reason of the server has a title, the reason as a sentence, and what to do next', () => {
  for (const [why, title] of kSaid) {
    assert.ok(sources.includes(why), `the server no longer says: ${why}`);
    const door = doorOf(why);
    assert.equal(door.title, title);
    assert.match(door.what, /^[A-Z].*[.,]\s*\.?$/);
    if (!why.startsWith('open the view')) assert.match(door.help, /\.$/);
  }
  assert.equal(new Set(kSaid.map(([why]) => doorOf(why).title)).size, kSaid.length);
  assert.deepEqual([doorOf('the moon is full').title, doorOf('the moon is full').what], ['Not let in', 'The moon is full.']);
  assert.match(doorOf('the moon is full').help, /new one/);
});

test('A server out of reach, and a browser that keeps nothing, are told apart from an invitation', () => {
  for (const { title, what, help } of [kUnreachable, keepsNothing(new Error('denied'))]) {
    assert.notEqual(title, 'Not let in');
    assert.match(`${what} ${help}`, /\. .*\.$/);
  }
  assert.match(kUnreachable.help, /network/);
  assert.match(keepsNothing({ name: 'SecurityError', message: '' }).what, /SecurityError/);
});
