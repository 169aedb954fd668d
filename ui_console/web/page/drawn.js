// Confirmation of drawn pictures. The server sends the next picture of a stream when an earlier one was confirmed.

/** @import { Drawn } from "./messages.d.ts" */

const SAY_EVERY_MS = 8; // chosen: with drives and beats, well below the 200 messages a second of the server's limit

/**
 * Confirms the newest picture of each stream, in turn, so slowly that the server does not cut off the page; this also
 * confirms the earlier ones.
 */
export class Confirmations {
  /** @param {(message: Drawn) => void} say */
  constructor(say) {
    this.say = say;
    /** @type {Map<string, Drawn>} */
    this.waiting = new Map();
    this.isPaused = false;
  }

  /**
   * Returns true: the message waits for its turn.
   *
   * @param {Drawn} message
   */
  add(message) {
    this.waiting.set(message.robot, message);
    if (!this.isPaused) this.next();
    return true;
  }

  next() {
    const [message] = this.waiting.values();
    this.isPaused = message !== undefined;
    if (message === undefined) return;
    this.waiting.delete(message.robot);
    this.say(message);
    setTimeout(() => this.next(), SAY_EVERY_MS);
  }
}
