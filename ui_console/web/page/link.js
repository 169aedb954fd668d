// The connection to the server: authenticates, reconnects, passes messages on, measures their age.

import { Freshness, makeClock } from "./freshness.js";

/** @import { BeatRequest } from "./messages.d.ts" */
/** @import { LinkChange, LinkState, Picture } from "./types.d.ts" */

const AGAIN_FIRST_MS = 500; // chosen: a restarted server is back soon
const AGAIN_MOST_MS = 5000; // chosen: a person waits no longer than this
const BEAT_EVERY_MS = 250; // chosen: resolution of the content's age
const LOOK_EVERY_MS = 100;
const OLD_MS = 800; // chosen: with the checks in between, the warning appears before the content is a second old
const SILENT_MS = 2000; // chosen: eight beats without return; browsers do not report the loss of a network
const ANSWER_MS = 10000; // chosen: as long as the server waits for a request and a token
const NOT_LET_IN = [1007, 1008, 1009]; // a token or a name that is too long or wrong
const MOST_BYTES = 4096; // the server's limit

/**
 * Whether the server reads a message of this length; it cuts off a page that sends a longer one.
 *
 * @param {object} message
 */
export function fits(message) {
  return new TextEncoder().encode(JSON.stringify(message)).length <= MOST_BYTES;
}

/**
 * One connection at a time; `heard` gets objects, `saw` gets pictures, `changed` gets {is, why, ageMs}, where `is` is
 * the state of the content: "fresh", "old" (no beat for most of a second), "down", or "refused" (wrong token).
 *
 * @template {{ view?: { beat?: number } }} Heard
 * @template {object} Said
 */
export class Link {
  /**
   * @param {{ heard: (message: Heard) => void, saw: (picture: Picture) => void, changed: (to: LinkChange) => void,
   *   silentMs?: number, oldMs?: number }} given
   */
  constructor({ heard, saw, changed, silentMs = SILENT_MS, oldMs = OLD_MS }) {
    this.heard = heard;
    this.saw = saw;
    this.changed = changed;
    this.silentMs = silentMs;
    this.oldMs = oldMs;
    /** @type {WebSocket | null} */
    this.socket = null;
    /** @type {LinkState} */
    this.is = "down";
    this.why = "";
    this.waitMs = AGAIN_FIRST_MS;
    /** @type {ReturnType<typeof setTimeout> | 0} */
    this.timer = 0;
    this.hello = {};
    this.now = makeClock();
    this.freshness = new Freshness();
    this.seenSince = 0;
    this.page = [...crypto.getRandomValues(new Uint32Array(4))].map((one) => one.toString(16)).join("-");
    setInterval(() => this.beat(), BEAT_EVERY_MS);
    setInterval(() => this.look(), LOOK_EVERY_MS);
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) return;
      this.seenSince = this.now(); // browsers rarely run the timers of a hidden page
      this.beat();
    });
  }

  /** @param {{ token: string, user: string }} hello */
  open(hello) {
    this.hello = hello;
    this.connect();
  }

  get isUp() {
    return this.is === "fresh" || this.is === "old";
  }

  /** Largest possible age of the content, in milliseconds. */
  get ageMs() {
    return this.freshness.age(this.now());
  }

  connect() {
    clearTimeout(this.timer);
    const at = new URL("socket", location.href); // of this page's own mission
    at.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    at.search = at.hash = "";
    const socket = new WebSocket(at);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.timer = setTimeout(() => this.giveUp("the server does not answer"), ANSWER_MS);
    socket.onopen = () => socket.send(JSON.stringify({ do: "hello", page: this.page, ...this.hello }));
    socket.onmessage = (event) => {
      if (socket !== this.socket) return;
      if (typeof event.data !== "string") {
        this.saw(readPacket(event.data));
        return;
      }
      if (!this.isUp) this.came();
      /** @type {Heard} */
      const message = JSON.parse(event.data);
      if (message.view?.beat !== undefined) this.freshness.returned(message.view.beat);
      this.heard(message);
      this.look();
    };
    socket.onclose = (event) => {
      if (socket !== this.socket) return;
      this.socket = null;
      clearTimeout(this.timer);
      if (NOT_LET_IN.includes(event.code) && !this.isUp) this.become("refused", event.reason);
      else this.again(event.reason || "no connection to the server");
    };
  }

  came() {
    clearTimeout(this.timer);
    this.waitMs = AGAIN_FIRST_MS;
    this.freshness.begin(this.now());
    this.seenSince = this.now();
    this.become("fresh", "");
    this.beat();
  }

  beat() {
    if (this.isUp) this.say({ do: "beat", number: this.freshness.beat(this.now()) });
  }

  /** Update the age of the content; not in a hidden page, because no person needs it there. */
  look() {
    const now = this.now();
    this.freshness.ran(now);
    if (!this.isUp || document.hidden) return;
    if (Math.min(this.freshness.silence(now), now - this.seenSince) > this.silentMs)
      this.giveUp("the server is silent");
    else if (this.freshness.age(now) > this.oldMs) this.become("old", "the server is silent");
    else this.become("fresh", "");
  }

  /**
   * End the connection, because its further messages would be too old, or because it does not come about.
   *
   * @param {string} why
   */
  giveUp(why) {
    const silent = this.socket;
    this.socket = null;
    silent?.close();
    this.again(why);
  }

  /** @param {string} why */
  again(why) {
    this.become("down", why);
    this.timer = setTimeout(() => this.connect(), this.waitMs);
    this.waitMs = Math.min(2 * this.waitMs, AGAIN_MOST_MS);
  }

  /**
   * @param {LinkState} is
   * @param {string} why
   */
  become(is, why) {
    const isNew = is !== this.is || (is === "down" && why !== this.why);
    [this.is, this.why] = [is, why];
    if (isNew) this.changed({ is, why, ageMs: this.ageMs });
  }

  /**
   * Send a message if it can be sent now; no message is kept for later, above all no drive command.
   *
   * @param {Said | BeatRequest} message
   */
  say(message) {
    if (!this.isUp || this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Whether messages still wait on this device. */
  get isClogged() {
    return this.socket !== null && this.socket.bufferedAmount > 1024;
  }
}

/** @param {ArrayBuffer} buffer */
function readPacket(buffer) {
  const view = new DataView(buffer);
  const length = view.getUint8(0);
  const robot = new TextDecoder().decode(new Uint8Array(buffer, 1, length));
  return { robot, number: view.getUint32(1 + length), jpeg: new Uint8Array(buffer, 13 + length) };
}
