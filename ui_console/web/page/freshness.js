// Largest possible age of the page's content. Pure: times are milliseconds of the caller's clock.

/**
 * Each beat goes to the server and returns with its next message. The content is at most as old as the newest returned
 * beat, whatever the delay in the network, at the server, or in a page that slept.
 */
export class Freshness {
  constructor() {
    /** @type {Map<number, number>} */
    this.sent = new Map(); // number of a beat → when it was sent
    this.number = 0;
    this.provenAt = -Infinity;
  }

  /**
   * A connection began: all its messages are newer than this.
   *
   * @param {number} now
   */
  begin(now) {
    this.sent.clear();
    this.provenAt = now;
  }

  /**
   * Returns the number of a beat that is sent now.
   *
   * @param {number} now
   */
  beat(now) {
    this.number += 1;
    this.sent.set(this.number, now);
    return this.number;
  }

  /**
   * A beat came back.
   *
   * @param {number} number
   */
  returned(number) {
    const sentAt = this.sent.get(number);
    if (sentAt === undefined) return;
    this.provenAt = sentAt;
    for (const earlier of [...this.sent.keys()].filter((one) => one <= number)) this.sent.delete(earlier);
  }

  /** @param {number} now */
  age(now) {
    return now - this.provenAt;
  }
}

/**
 * Returns a clock, in milliseconds, that no device stops: one of the device's clocks stops during sleep, the other may
 * be set back; this clock follows the faster one.
 */
export function makeClock(steady = () => performance.now(), wall = () => Date.now()) {
  let [steadyAt, wallAt, total] = [steady(), wall(), 0];
  return () => {
    const [steadyNow, wallNow] = [steady(), wall()];
    total += Math.max(steadyNow - steadyAt, wallNow - wallAt, 0);
    [steadyAt, wallAt] = [steadyNow, wallNow];
    return total;
  };
}
