// An invitation's link ends with #PASS. It is shown to the server once, which answers with a cookie that no script can
// read, and leaves the address bar and the history.

const kForm = /^#([A-Za-z0-9_-]{90,256})$/;

// '' or why the invitation does not hold. True to `fetch` and `location` of a browser.
export async function enter({ fetch = globalThis.fetch.bind(globalThis), location = globalThis.location, history = globalThis.history } = {}) {
  const pass = kForm.exec(location.hash)?.[1];
  if (!pass) return '';
  const answer = await fetch('/api/enter', {
    method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ pass }),
  });
  if (!answer.ok && answer.status !== 401) throw new Error(`the server answers ${answer.status}`);
  history.replaceState(null, '', location.pathname);
  return answer.ok ? '' : (await answer.json()).error;
}
