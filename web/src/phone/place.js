// Where the phone is and which way it looks, as far as the browser tells: only pages over TLS are told.

const kFreshMs = 30000;
const kTurns = ['deviceorientationabsolute', 'deviceorientation'];

export class Place {
  constructor() {
    this.position = null; // {latitude, longitude, altitude, accuracy, at}
    this.heading = null;
    this.watch = null;
  }

  get possible() {
    return Boolean(globalThis.isSecureContext && navigator.geolocation);
  }

  // By a tap: browsers ask the person. changed(why): '' when it goes on.
  async start(changed) {
    if (!this.possible || this.watch !== null) return;
    this.watch = navigator.geolocation.watchPosition(({ coords }) => {
      const { latitude, longitude, altitude, accuracy } = coords;
      this.position = { latitude, longitude, altitude: Number.isFinite(altitude) ? altitude : null, accuracy, at: Date.now() };
      changed('');
    }, (error) => changed(error.code === 1 ? 'The browser may not tell where this phone is.' : 'No position yet.'),
    { enableHighAccuracy: true, maximumAge: 5000 });
    try {
      if (typeof DeviceOrientationEvent?.requestPermission === 'function') await DeviceOrientationEvent.requestPermission();
    } catch { /* no heading then */ }
    if (this.watch === null) return; // stopped meanwhile
    for (const turn of kTurns) addEventListener(turn, this.turned);
  }

  turned = (e) => {
    const angle = globalThis.screen?.orientation?.angle ?? 0;
    if (Number.isFinite(e.webkitCompassHeading)) this.heading = (e.webkitCompassHeading + angle) % 360;
    else if (e.absolute && Number.isFinite(e.alpha)) this.heading = (360 - e.alpha + angle) % 360;
  };

  stop() {
    for (const turn of kTurns) removeEventListener(turn, this.turned);
    if (this.watch !== null) navigator.geolocation.clearWatch(this.watch);
    this.watch = null;
    this.position = this.heading = null;
  }

  // For a photo that was taken at that time (ms since 1970); null where it is not known.
  at(time) {
    const { position } = this;
    if (!position || Math.abs(position.at - time) > kFreshMs) return null;
    return { ...position, heading: this.heading };
  }
}

// [latitude, longitude] and, where the browser tells one, the altitude.
export const gpsOf = (place) => place && [place.latitude, place.longitude, ...(place.altitude === null ? [] : [place.altitude])];
