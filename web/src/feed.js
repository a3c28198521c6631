// The connection to the server: the events of the ledger in order, none twice and none missing, and the messages
// that are no facts. Reconnects with a growing pause. Gaps are pulled by /api/events.
//
// Everything from outside is passed in, so that tests replace it.

const kFirstPauseMs = 500;
const kLongestPauseMs = 10000;
const kProbeAfterMs = 10000; // of silence on an open connection
const kAnswerMs = 8000;
const kRefusedCode = 1008; // RFC 6455: against the server's policy

export class Feed {
  // on: {events(list), reset(sessionId), shape(message), dense(message), status(message), connection({connected, heard, refused}), synced()}
  // refused: '' or why the server lets this page in no more; the feed stops then.
  constructor(on, { fetch, WebSocket, url, now, setTimeout, clearTimeout, random } = {}) {
    this.on = on;
    this.fetch = fetch ?? globalThis.fetch.bind(globalThis);
    this.WebSocket = WebSocket ?? globalThis.WebSocket;
    this.url = url ?? { http: '', ws: `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws` };
    this.now = now ?? (() => performance.now());
    this.setTimeout = setTimeout ?? globalThis.setTimeout.bind(globalThis);
    this.clearTimeout = clearTimeout ?? globalThis.clearTimeout.bind(globalThis);
    this.random = random ?? Math.random;
    this.covered = 0; // every event up to here was handed on
    this.known = 0; // the ledger's head, as far as heard
    this.sessionId = null;
    this.socket = null;
    this.connected = false;
    this.heard = null;
    this.pause = kFirstPauseMs;
    this.pulling = null;
    this.early = []; // messages of events that came while a range was pulled
    this.timer = null;
    this.watchdog = null;
    this.stopped = false;
    this.refused = '';
    this.synced = false;
  }

  start() {
    this.stopped = false;
    this.open();
  }

  stop() {
    this.stopped = true;
    this.clearTimeout(this.timer);
    this.clearTimeout(this.watchdog);
    this.socket?.close();
  }

  // Now, without waiting for the pause to end: the network came back, or the page is seen again.
  retryNow() {
    if (this.connected || this.stopped || this.socket) return;
    this.clearTimeout(this.timer);
    this.pause = kFirstPauseMs;
    this.open();
  }

  open() {
    const socket = new this.WebSocket(this.url.ws);
    this.socket = socket;
    // A server that takes the connection and says nothing.
    this.clearTimeout(this.watchdog);
    this.watchdog = this.setTimeout(() => socket.close(), kAnswerMs);
    socket.onmessage = (m) => {
      if (this.socket === socket) this.receive(m.data);
    };
    socket.onclose = (e) => {
      if (this.socket !== socket) return;
      if (e?.code === kRefusedCode) this.refuse(e.reason);
      else this.lost();
    };
    socket.onerror = () => {};
  }

  // The invitation ended: there is nothing to wait for.
  refuse(why) {
    this.refused = why || 'the invitation does not hold any more';
    this.stop();
    this.lost();
  }

  lost() {
    const cameToNothing = !this.connected;
    this.socket = null;
    this.clearTimeout(this.watchdog);
    this.connected = false;
    this.tellConnection();
    if (this.stopped) return;
    if (cameToNothing) this.get('/api/session').catch(() => {}); // a refused handshake gives no reason; this does
    this.timer = this.setTimeout(() => this.open(), this.pause * (0.75 + 0.5 * this.random()));
    this.pause = Math.min(2 * this.pause, kLongestPauseMs);
  }

  tellConnection() {
    this.on.connection({ connected: this.connected, heard: this.heard, refused: this.refused });
  }

  receive(text) {
    let message;
    try {
      message = JSON.parse(text);
    } catch {
      return; // of another version: what is no JSON says nothing
    }
    this.noteHeard();
    switch (message.type) {
      case 'hello':
        this.greet(message);
        break;
      case 'events':
        this.take(message);
        break;
      case 'head':
        this.known = Math.max(this.known, message.head);
        this.catchUp();
        break;
      case 'shape':
        this.on.shape(message);
        break;
      case 'dense':
        this.on.dense(message);
        break;
      case 'status':
        this.on.status(message);
        break;
      default:
    }
  }

  noteHeard() {
    this.heard = this.now();
    this.clearTimeout(this.watchdog);
    this.watchdog = this.setTimeout(() => this.probe(), kProbeAfterMs);
  }

  // Silence may be rest, or a cable that was pulled.
  async probe() {
    const socket = this.socket;
    try {
      await this.get('/api/session');
      if (this.socket === socket) this.noteHeard();
      this.tellConnection();
    } catch {
      if (this.socket === socket) socket?.close();
    }
  }

  greet({ session_id: id, head }) {
    const another = this.sessionId !== null && (id !== this.sessionId || head < this.covered);
    if (another) {
      this.covered = this.known = 0;
      this.early = [];
      this.synced = false;
    }
    if (another || this.sessionId === null) this.on.reset(id);
    this.sessionId = id;
    this.known = Math.max(this.known, head);
    this.connected = true;
    this.pause = kFirstPauseMs;
    this.tellConnection();
    this.catchUp();
  }

  take(message) {
    if (this.pulling) {
      this.early.push(message);
      // What came early is in the range that is pulled next.
      if (this.early.length > 200) this.early.shift();
      this.known = Math.max(this.known, lastOf(message));
      return;
    }
    if (message.after !== undefined && message.after > this.covered) {
      this.known = Math.max(this.known, lastOf(message));
      this.catchUp();
      return;
    }
    this.handOn(message.events);
    this.covered = Math.max(this.covered, lastOf(message));
    this.known = Math.max(this.known, this.covered);
  }

  handOn(events) {
    const fresh = events.filter((e) => e.seq > this.covered);
    if (fresh.length === 0) return;
    this.covered = fresh[fresh.length - 1].seq;
    this.on.events(fresh);
  }

  catchUp() {
    if (this.pulling) return;
    const session = this.sessionId;
    this.pulling = this.pullRange(session)
      .catch(() => true) // the socket is closed, too, or will be: then hello begins anew
      .then((failed) => {
        this.pulling = null;
        const early = this.early.splice(0);
        if (failed || session !== this.sessionId) {
          if (this.connected) this.setTimeout(() => this.connected && this.catchUp(), 1000);
          return;
        }
        for (const message of early) this.take(message);
        if (!this.pulling && this.covered < this.known) this.catchUp();
        if (!this.pulling && !this.synced) {
          this.synced = true;
          this.on.synced?.();
        }
      });
  }

  // Until nothing is left of what the ledger has. Facts that make no event leave gaps between seqs.
  async pullRange(session) {
    while (this.covered < this.known) {
      const { head, next, events } = await this.get(`/api/events?from=${this.covered + 1}`);
      if (session !== this.sessionId) return true;
      this.noteHeard();
      this.handOn(events);
      if (next > this.covered + 1) this.covered = next - 1;
      else if (events.length === 0) this.covered = Math.max(this.covered, head);
      this.known = Math.max(this.known, head);
    }
    return false;
  }

  async get(path) {
    const control = new AbortController();
    const timer = this.setTimeout(() => control.abort(), kAnswerMs);
    try {
      const answer = await this.fetch(this.url.http + path, { signal: control.signal, cache: 'no-store' });
      if (answer.status === 401 || answer.status === 403) this.refuse((await answer.json()).error);
      if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
      return await answer.json();
    } finally {
      this.clearTimeout(timer);
    }
  }
}

function lastOf({ head, events }) {
  return head ?? (events.length > 0 ? events[events.length - 1].seq : 0);
}
