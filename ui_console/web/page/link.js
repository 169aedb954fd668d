// The connection to the server: says who is there, comes back by itself, hands on what is heard.

const AGAIN_FIRST_MS = 500; // chosen: a server that was restarted is back soon
const AGAIN_MOST_MS = 5000; // chosen: a person waits no longer before looking
const SILENT_MS = 2000; // chosen: the server says something four times a second; no browser tells that a network is gone
const NOT_LET_IN = 1008;

/** One connection at a time; `heard` gets objects, `saw` gets pictures, `changed` gets (isUp, why). */
export class Link {
  constructor({ heard, saw, changed, silentMs = SILENT_MS }) {
    Object.assign(this, { heard, saw, changed });
    this.socket = null;
    this.isUp = false;
    this.waitMs = AGAIN_FIRST_MS;
    this.timer = 0;
    this.heardAt = 0;
    setInterval(() => { if (this.isUp && performance.now() - this.heardAt > silentMs) this.giveUp(); }, 250);
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
      this.heardAt = performance.now();
      if (typeof event.data !== "string") { this.saw(readPacket(event.data)); return; }
      if (!this.isUp) { this.isUp = true; this.waitMs = AGAIN_FIRST_MS; this.changed(true, ""); }
      this.heard(JSON.parse(event.data));
    };
    socket.onclose = (event) => {
      if (socket !== this.socket) return;
      const wasUp = this.isUp;
      this.isUp = false;
      if (event.code === NOT_LET_IN && !wasUp) { this.socket = null; this.changed(false, event.reason, true); return; }
      this.again(event.reason || "no connection to the server");
    };
  }

  /** Nothing is heard any more: whatever this connection still brings is too old. */
  giveUp() {
    const silent = this.socket;
    this.socket = null;
    this.isUp = false;
    silent.close();
    this.again("the server is silent");
  }

  again(why) {
    this.changed(false, why);
    this.timer = setTimeout(() => this.connect(), this.waitMs);
    this.waitMs = Math.min(2 * this.waitMs, AGAIN_MOST_MS);
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
