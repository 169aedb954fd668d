// Largest possible age of the page's content. Pure: times are milliseconds of the caller's clock.

const STALLED_MS = 500; // chosen: five times as long as a page waits between two looks

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
    this.ranAt = 0;
    /** @type {{ at: number, ms: number }[]} */
    this.stalls = []; // when the page ran again, and for how long it had not
  }

  /**
   * A connection began: all its messages are newer than this.
   *
   * @param {number} now
   */
  begin(now) {
    this.sent.clear();
    this.provenAt = now;
    this.ranAt = now;
    this.stalls = [];
  }

  /**
   * The page runs now. If it did not for a while, because its device was busy, it sent no beats and read no messages.
   *
   * @param {number} now
   */
  ran(now) {
    const ms = now - this.ranAt - STALLED_MS;
    if (ms > 0) this.stalls.push({ at: now, ms });
    this.ranAt = now;
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
    this.stalls = this.stalls.filter(({ at }) => at > sentAt);
    for (const earlier of [...this.sent.keys()].filter((one) => one <= number)) this.sent.delete(earlier);
  }

  /** @param {number} now */
  age(now) {
    return now - this.provenAt;
  }

  /**
   * Time in which an answer could have come: the age less the time in which the page did not run.
   *
   * @param {number} now
   */
  silence(now) {
    return this.age(now) - this.stalls.reduce((sum, { ms }) => sum + ms, 0);
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
