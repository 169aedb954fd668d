// The connection to the server: says who is there, comes back by itself, hands on what is heard.

const AGAIN_FIRST_MS = 500; // chosen: a server that was restarted is back soon
const AGAIN_MOST_MS = 5000; // chosen: a person waits no longer before looking
const NOT_LET_IN = 1008;

/** One connection at a time; `heard` gets objects, `saw` gets pictures, `changed` gets (isUp, why). */
export class Link {
  constructor({ heard, saw, changed }) {
    Object.assign(this, { heard, saw, changed });
    this.socket = null;
    this.isUp = false;
    this.waitMs = AGAIN_FIRST_MS;
    this.timer = 0;
  }

  open(hello) {
    this.hello = hello;
    this.connect();
  }

  connect() {
    clearTimeout(this.timer);
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => socket.send(JSON.stringify({ do: "hello", ...this.hello }));
    socket.onmessage = (event) => {
      if (socket !== this.socket) return;
      if (typeof event.data !== "string") { this.saw(readPacket(event.data)); return; }
      if (!this.isUp) { this.isUp = true; this.waitMs = AGAIN_FIRST_MS; this.changed(true, ""); }
      this.heard(JSON.parse(event.data));
    };
    socket.onclose = (event) => {
      if (socket !== this.socket) return;
      const wasUp = this.isUp;
      this.isUp = false;
      if (event.code === NOT_LET_IN && !wasUp) { this.socket = null; this.changed(false, event.reason, true); return; }
      this.changed(false, event.reason || "no connection to the server");
      this.timer = setTimeout(() => this.connect(), this.waitMs);
      this.waitMs = Math.min(2 * this.waitMs, AGAIN_MOST_MS);
    };
  }

  /** Say something if it can be said now: nothing is kept for later, least of all a drive. */
  say(message) {
    if (!this.isUp || this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Is what was said still waiting to leave this device? */
  get isClogged() {
    return this.socket !== null && this.socket.bufferedAmount > 1024;
  }
}

function readPacket(buffer) {
  const view = new DataView(buffer);
  const length = view.getUint8(0);
  const robot = new TextDecoder().decode(new Uint8Array(buffer, 1, length));
  return { robot, number: view.getUint32(1 + length), jpeg: new Uint8Array(buffer, 13 + length) };
}
