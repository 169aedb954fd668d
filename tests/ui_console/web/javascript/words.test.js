// Words and numbers for people, and when a hand has to let go.

import assert from "node:assert/strict";
import { test } from "node:test";

import { isOther } from "../../../../ui_console/web/page/hand.js";
import { lasting, readingOrder, seconds, shortened } from "../../../../ui_console/web/page/text.js";

test("times have one digit, and none where there is none", () => {
  assert.equal(seconds(12.34), "12.3 s");
  assert.equal(seconds(-1), "");
  assert.equal(seconds(undefined), "");
  assert.equal(lasting(7.4), " 7 s ago");
  assert.equal(lasting(200), " 3 min ago");
  assert.equal(lasting(-1), "");
});

test("names are in the order of counting", () => {
  assert.deepEqual(["scout10", "scout2", "rover1"].sort(readingOrder), ["rover1", "scout2", "scout10"]);
});

test("of a long name the end is kept, because names differ there", () => {
  assert.equal(shortened("scout1", 6), "scout1");
  assert.equal(shortened("watch-scout1", 7), "…scout1");
  assert.equal(shortened("watch-scout1", 2), "");
});

test("another robot, hold, grant or stop is another one; another picture is not", () => {
  const own = { is_held: true, robot: "scout1", epoch: 3, stop: null, status: "" };
  assert.equal(isOther(null, own), true);
  assert.equal(isOther(own, { ...own, status: "you hold scout1" }), false);
  for (const change of [{ is_held: false }, { robot: "scout2" }, { epoch: 4 }, { stop: { number: 1 } }]) {
    assert.equal(isOther(own, { ...own, ...change }), true);
  }
});
