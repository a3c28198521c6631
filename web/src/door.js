// Why somebody is not let in, or a page cannot go on, and what to do next: {title, what, help}. Pure.
import { sentence } from './words.js';

const kAskAgain = 'Ask whoever runs the session for a new one, a link or a QR code, and open it here.';

// [words of a server's reason (libs/net/auth/web_pass.cc, libs/view/http/guests.cc, access.cc), title, help]
const kReasons = [
  ['was revoked', 'Invitation revoked', kAskAgain],
  ['has expired', 'Invitation expired', kAskAgain],
  ['is cut or damaged', 'Invitation damaged', kAskAgain],
  ['is for another session', 'Invitation for another session', kAskAgain],
  ['open the link of your invitation', 'Invitation needed', 'If yours was opened here before, it no longer holds: ask whoever runs the session for a new one, a link or a QR code.'],
  ['is for sending photos', 'This invitation sends photos', 'Open it at /phone of this address. To look at the map, ask whoever runs the session for an invitation of a viewer.'],
  ['is for looking', 'This invitation is for looking', 'To send photos, ask whoever runs the session for an invitation of an agent.'],
  ['open the view by the server', 'Another address is needed', ''],
];

// why: of the server's answer.
export function doorOf(why) {
  const known = kReasons.find(([words]) => why.includes(words));
  const [, title, help] = known ?? ['', 'Not let in', kAskAgain];
  return { title, what: sentence(why), help };
}

export const kConnecting = { title: 'Connecting', what: 'The page asks the server of this session.', help: '' };

export const kUnreachable = {
  title: 'Server not reached', what: 'The server of this session does not answer.',
  help: 'Is it running, and is this device in its network? The page tries again by itself.',
};

// Of a phone: error: of its browser's storage.
export const keepsNothing = (error) => ({
  title: 'Photos cannot be kept', what: `This browser stores nothing (${error.message || error.name}).`,
  help: 'Leave its private mode, or open the invitation in another browser.',
});
