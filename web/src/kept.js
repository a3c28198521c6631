// A list that this browser keeps of a session, so that a reload has it, and so do other pages of the same address.

function browserStorage() {
  try {
    return globalThis.localStorage ?? null;
  } catch {
    return null; // storage may be forbidden
  }
}

export class Kept {
  // isSound(entry): whether it is none that another version, or somebody by hand, left there
  constructor(prefix, isSound, storage = browserStorage()) {
    Object.assign(this, { prefix, isSound, storage });
    this.key = null;
    this.list = [];
    this.kept = false; // in the browser
  }

  open(session) {
    this.key = this.prefix + session;
    this.list = [];
    this.read();
  }

  // key: of a browser's storage event. Returns whether the list was read again.
  heard(key) {
    if (this.key === null || (key !== this.key && key !== null)) return false;
    this.read();
    return true;
  }

  read() {
    try {
      this.list = this.parse(this.storage.getItem(this.key) ?? '[]');
      this.kept = true;
    } catch {
      this.kept = false;
    }
  }

  parse(text) {
    try {
      const list = JSON.parse(text);
      return Array.isArray(list) ? list.filter((entry) => this.isSound(entry)) : [];
    } catch {
      return [];
    }
  }

  change(list) {
    this.list = list;
    try {
      if (list.length > 0) this.storage.setItem(this.key, JSON.stringify(list));
      else this.storage.removeItem(this.key);
      this.kept = true;
    } catch {
      this.kept = false; // then it lasts as long as the page
    }
  }
}
