// What was found in the log, part by part.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Found } from "../../../../ui_console/web/page/log.js";

const event = (at_s) => ({
  at_s,
  level: "info",
  subject: "scout1",
  what: 'said "so"\nand more',
  person: "",
  where: "ui_console/c",
  cause: "",
  time: "2026-05-04T14:10:00.000+00:00",
});
const part = (number, first, ats, more = {}) => ({
  number,
  first,
  events: ats.map(event),
  total: 5,
  left_out: 0,
  since_s: 0,
  asked_s: 9.04,
  ...more,
});

test("parts are taken in order, once, and only those of this search", () => {
  const found = new Found(2);
  assert.equal(found.take(part(1, 0, [5])), false);
  assert.equal(found.take(part(2, 0, [5, 4, 3])), true);
  assert.equal(found.take(part(2, 0, [5, 4, 3])), false);
  assert.equal(found.take(part(2, 4, [1])), false);
  assert.equal(found.isWhole, false);
  assert.equal(found.take(part(2, 3, [2, 1])), true);
  assert.equal(found.isWhole, true);
  assert.deepEqual(
    found.events.map((one) => one.at_s),
    [5, 4, 3, 2, 1],
  );
});

test("the file has one JSON object in each line, the oldest first", () => {
  const found = new Found(1);
  found.take(part(1, 0, [5, 4]));
  const lines = found.lines().split("\n");
  assert.equal(lines.pop(), "");
  assert.deepEqual(lines.map(JSON.parse), [event(4), event(5)]);
});

test("people read how much there is, and what is missing", () => {
  const found = new Found(1);
  found.take(part(1, 0, [5], { total: 1 }));
  assert.equal(found.line(), "1 event found, up to 9.0 s");
  const more = new Found(1);
  more.take(part(1, 0, [5], { left_out: 7, since_s: 2.5 }));
  assert.equal(
    more.line(),
    "5 events found, up to 9.0 s; 7 older ones are left out, search a shorter time; nothing from before 2.5 s is kept",
  );
});
