// The dialog that lets a phone or another person in: a QR code and its link.
import { byId, h, iconButton, svg } from './dom.js';

const kQuiet = 4; // modules, as the standard has it

function qrCode(rows) {
  const size = rows.length + 2 * kQuiet;
  const path = rows.flatMap((row, y) => [...row].flatMap((c, x) => (c === '1' ? [`M${x + kQuiet} ${y + kQuiet}h1v1h-1z`] : []))).join('');
  return svg('svg', { viewBox: `0 0 ${size} ${size}`, class: 'qr', role: 'img', 'aria-label': 'QR code of the link' },
    svg('rect', { width: size, height: size, fill: '#fff' }), svg('path', { d: path, fill: '#000' }));
}

const kRoles = {
  agent: ['A phone that takes photos', 'It opens a page that takes photos and sends them to this session.'],
  viewer: ['Somebody who looks', 'This view, on another screen.'],
};

const kLongestName = 24;

// As the server takes names: letters without accents, digits, - and _. '' where nothing is left of it.
export function invitedName(text) {
  const plain = text.normalize('NFKD').replace(/\p{M}/gu, '').replace(/[^A-Za-z0-9_-]+/g, '-');
  return plain.slice(0, kLongestName).replace(/^-+|-+$/g, '');
}

// agents: names that photos have come from
export function showInvite({ agents }) {
  const dialog = byId('dialog');
  dialog.className = 'narrow';
  const result = h('div', { className: 'invitation', role: 'status' });
  const name = h('input', { type: 'text', maxlength: 60, autocomplete: 'off', autocapitalize: 'off', spellcheck: 'false', placeholder: 'anna' });
  const make = async (role) => {
    const asked = invitedName(name.value);
    result.dataset.role = '';
    if (name.value.trim() !== '' && asked === '') {
      result.replaceChildren(h('p', {}, 'A name has letters from a to z, digits, - or _.'));
      name.focus();
      return;
    }
    result.replaceChildren(h('p', { className: 'muted' }, 'Making an invitation…'));
    try {
      const answer = await fetch('/api/invitations', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ role, name: asked }) });
      const made = await answer.json();
      if (!answer.ok) throw new Error(made.error);
      const shown = made.plain ?? made.secure;
      result.dataset.role = role;
      result.replaceChildren(...[
        h('p', {}, h('b', {}, `For ${made.name}.`), ` ${kRoles[role][1]} Whoever has the link can do so: give each phone one of its own.`),
        role === 'agent' && agents.includes(made.name) && h('p', {}, `Photos of ${made.name} are here already: those of this phone count as the same.`),
        qrCode(shown.qr), h('p', {}, h('code', {}, shown.link)),
        made.plain && h('p', { className: 'muted' }, 'Encrypted, and with the camera view; the browser warns once: ', h('code', {}, made.secure.link)),
      ].filter(Boolean));
    } catch (error) {
      result.replaceChildren(h('p', {}, `No invitation was made: ${error.message}.`));
    }
  };
  dialog.replaceChildren(
    h('div', { className: 'head_row' }, h('h2', { id: 'dialog_title' }, 'Invite'), iconButton('close', 'Close', () => dialog.close())),
    h('label', { className: 'invite_name' }, h('span', {}, 'Whose phone or page is it?'), name),
    h('div', { className: 'invite_roles' }, Object.entries(kRoles).map(([role, [label]]) => h('button', { type: 'button', className: 'download', onclick: () => make(role) }, label))),
    result);
  dialog.showModal();
  if (!matchMedia('(pointer: coarse)').matches) name.focus(); // a phone's keyboard hides the rest
}
