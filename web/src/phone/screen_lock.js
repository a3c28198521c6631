// Keeps the screen on for as long as something is being done. The browser takes the lock back whenever the page is hidden.

export class ScreenLock {
  // wanted(): whether the screen is to stay on
  constructor(wanted, locks = globalThis.navigator?.wakeLock) {
    Object.assign(this, { wanted, locks });
    this.lock = null;
    this.asking = false;
  }

  get held() {
    return this.lock !== null;
  }

  async ask() {
    if (!this.locks || this.lock || this.asking || !this.wanted()) return;
    this.asking = true;
    try {
      const lock = await this.locks.request('screen');
      if (!lock.released) this.lock = lock;
      lock.addEventListener('release', () => {
        if (this.lock === lock) this.lock = null;
      });
    } catch { /* the browser saves energy: the screen goes off as ever */ }
    this.asking = false;
    this.check();
  }

  // Lets go once it is not wanted any more.
  check() {
    if (this.wanted()) return;
    this.lock?.release();
    this.lock = null;
  }
}
