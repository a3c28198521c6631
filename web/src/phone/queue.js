// The photos of this phone, by the SHA-256 of their bytes, in IndexedDB: they outlive the page, the browser and a dead
// battery. A photo's bytes stay until the session's ledger has it; its thumbnail and its state stay.
//
// A photo: {sha, name, size, taken (utime in microseconds), gps ([lat, lon], [lat, lon, alt] or null), added, state, reason, cause, image,
// offset, thumbnail (Blob or null), bytes (Blob; null once the ledger has it)}

const kDatabase = 'skein.photos';

const done = (request) => new Promise((resolve, reject) => {
  request.onsuccess = () => resolve(request.result);
  request.onerror = () => reject(request.error);
});

export class Queue {
  // One session's. Throws where the browser keeps nothing, as in some private windows.
  static async open(sessionId, indexedDB = globalThis.indexedDB) {
    const opening = indexedDB.open(`${kDatabase}.${sessionId}`, 1);
    opening.onupgradeneeded = () => {
      opening.result.createObjectStore('photos', { keyPath: 'sha' });
      opening.result.createObjectStore('bytes');
    };
    const queue = new Queue();
    queue.database = await done(opening);
    const all = await done(queue.database.transaction('photos').objectStore('photos').getAll());
    queue.photos = new Map(all.sort((a, b) => a.added - b.added).map((p) => [p.sha, p]));
    return queue;
  }

  // False if it is there already. Durable when this ends.
  async add(photo, bytes) {
    if (this.photos.has(photo.sha)) return false;
    this.photos.set(photo.sha, photo);
    try {
      await this.write(['photos', 'bytes'], (photos, store) => {
        photos.put(photo);
        store.put(bytes, photo.sha);
      });
    } catch (error) {
      this.photos.delete(photo.sha);
      throw error;
    }
    return true;
  }

  // A photo that is there already, with its bytes, to be sent anew. Durable when this ends.
  async again(sha, changes, bytes) {
    const photo = { ...this.photos.get(sha), ...changes };
    await this.write(['photos', 'bytes'], (photos, store) => {
      photos.put(photo);
      store.put(bytes, sha);
    });
    Object.assign(this.photos.get(sha), changes);
  }

  // False if that is no change. It holds for this page even where it cannot be written; then this throws.
  async change(sha, changes) {
    const photo = this.photos.get(sha);
    if (!photo || Object.entries(changes).every(([k, v]) => photo[k] === v)) return false;
    Object.assign(photo, changes);
    await this.write(['photos'], (photos) => photos.put(photo));
    return true;
  }

  bytesOf(sha) {
    return done(this.database.transaction('bytes').objectStore('bytes').get(sha));
  }

  dropBytes(sha) {
    return this.write(['bytes'], (store) => store.delete(sha));
  }

  write(names, change) {
    return new Promise((resolve, reject) => {
      const transaction = this.database.transaction(names, 'readwrite', { durability: 'strict' });
      transaction.oncomplete = () => resolve();
      transaction.onabort = transaction.onerror = () => reject(transaction.error);
      change(...names.map((name) => transaction.objectStore(name)));
    });
  }
}
