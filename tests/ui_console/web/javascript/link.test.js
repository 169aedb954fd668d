// A connection that does not come about is given up, and the page tries again.

import assert from "node:assert/strict";
import { beforeEach, mock, test } from "node:test";

import { Link } from "../../../../ui_console/web/page/link.js";

const WAITS_MS = 10000; // as link.js has it
const AGAIN_MS = 500;

/** A socket whose server accepts the connection, and says nothing. */
class SilentSocket {
  static OPEN = 1;
  static made = [];

  constructor() {
    this.readyState = SilentSocket.OPEN;
    this.isClosed = false;
    SilentSocket.made.push(this);
  }

  send() {}

  close() {
    this.isClosed = true;
  }
}

beforeEach(() => {
  mock.timers.reset();
  mock.timers.enable({ apis: ["setTimeout", "setInterval", "Date"] });
  SilentSocket.made = [];
  globalThis.WebSocket = SilentSocket;
  globalThis.document = { hidden: false, addEventListener() {} };
  globalThis.location = { href: "http://localhost:8420/", protocol: "http:" };
});

function opened() {
  const link = new Link({ heard() {}, saw() {}, changed() {} });
  link.open({ token: "t", user: "" });
  return link;
}

test("a server that never answers is tried again", () => {
  const link = opened();
  mock.timers.tick(WAITS_MS);
  assert.equal(link.why, "the server does not answer");
  mock.timers.tick(AGAIN_MS);
  const [first, second] = SilentSocket.made;
  assert.ok(first.isClosed && !second.isClosed);
});

test("a server that answered is not given up while it answers", () => {
  const link = opened();
  const [socket] = SilentSocket.made;
  for (let passed = 0; passed < 2 * WAITS_MS; passed += 250) {
    socket.onmessage({ data: JSON.stringify({ view: { beat: link.freshness.number } }) });
    mock.timers.tick(250);
  }
  assert.equal(link.is, "fresh");
  assert.equal(SilentSocket.made.length, 1);
});

const WRONG = { "a wrong token": 1008, "a token that is too long": 1009, "a name that is too long": 1007 };
for (const [what, code] of Object.entries(WRONG)) {
  test(`${what} is not tried again`, () => {
    const link = opened();
    SilentSocket.made[0].onclose({ code, reason: "why" });
    mock.timers.tick(2 * WAITS_MS);
    assert.equal(link.is, "refused");
    assert.equal(SilentSocket.made.length, 1);
  });
}
