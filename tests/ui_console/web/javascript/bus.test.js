// Keys on the bus: what is told of a row, and where the line of a plot goes.

import assert from "node:assert/strict";
import { test } from "node:test";

import { bytesText, messageText, textsOf, toldOf } from "../../../../ui_console/web/page/key_list.js";
import { headOf, toggled } from "../../../../ui_console/web/page/key_view.js";
import { extend, lineOf, short } from "../../../../ui_console/web/page/plot.js";

const row = {
  key: "resource_pool/scout1/telemetry",
  source: "resource_pool/scout1",
  schema: "ScoutTelemetry/1",
  messages_per_s: 9.96,
  bytes_per_s: 12345,
  mean_bytes: 120,
  heard_s: 3,
};

test("a row says how often, and how much", () => {
  assert.deepEqual(textsOf(row), ["ScoutTelemetry/1", "10.0", "12.3 kB", "120 B"]);
  assert.equal(textsOf({ ...row, messages_per_s: 25.2 })[1], "25");
  assert.equal(bytesText(7.2e6), "7.2 MB");
});

test("a sender is named if the key is not its own", () => {
  assert.equal(messageText({ ...row, source: "resource_pool/scout10" }), "ScoutTelemetry/1 from resource_pool/scout10");
  assert.equal(messageText({ key: row.key, source: "", schema: "" }), "no message");
});

test("a list that is not whole says so", () => {
  assert.equal(toldOf({ rows: [], matching: 0, heard: 0, dropped: 0 }), "nothing was said yet");
  assert.equal(toldOf({ rows: [row], matching: 1, heard: 40, dropped: 0 }), "40 heard, 1 shown");
  assert.match(
    toldOf({ rows: [row], matching: 30, heard: 40, dropped: 7 }),
    /1 of 30 shown; words.*7 messages came too/,
  );
});

test("a field's plot comes and goes, and a fifth one replaces the first", () => {
  assert.deepEqual(toggled(["a"], "b"), ["a", "b"]);
  assert.deepEqual(toggled(["a", "b"], "a"), ["b"]);
  assert.deepEqual(toggled(["a", "b", "c", "d"], "e"), ["b", "c", "d", "e"]);
});

test("a plot keeps the last minute, and begins anew when time goes back", () => {
  /** @type {[number, number][]} */
  const points = [];
  for (let at_s = 0; at_s <= 100; at_s += 1) extend(points, [at_s, at_s]);
  assert.deepEqual([points[0], points.length], [[40, 40], 61]);
  extend(points, [50, 1]);
  assert.deepEqual(points, [[50, 1]]);
});

test("the line ends at the right, most on top, and a number that stays lies in the middle", () => {
  assert.deepEqual(
    lineOf([
      [0, 1],
      [60, 3],
    ]),
    { line: "0.0,82.0 400.0,18.0", least: 1, most: 3, span_s: 60 },
  );
  assert.equal(lineOf([[5, 2]]).line, "400.0,50.0");
  assert.equal(short(1234.5678), "1235");
});

test("the head of a message says when, which, how long and why", () => {
  const message = { number: 3, stamp_s: 2, sequence: 7, cause: "a#1", size_bytes: 40, trouble: "", has_picture: false };
  assert.equal(headOf(message), "sent at 2.0 s, number 7, 40 B, because of a#1");
  assert.match(headOf({ ...message, cause: "", trouble: "odd" }), /40 B; odd$/);
});
