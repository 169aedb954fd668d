// Which marker comes next.

import assert from "node:assert/strict";
import { test } from "node:test";

import { nextMarker } from "../../../../ui_console/web/page/playback.js";

/** @import { Marker } from "../../../../ui_console/web/page/messages.d.ts" */

/** @param {number} at_s @returns {Marker} */
const marker = (at_s) => ({ at_s, kind: "grant", name: "watch", line: "" });
const MARKERS = [1, 2, 2, 5].map(marker);

test("ahead is the first after the time, back the last before it, and that one is none at its own time", () => {
  assert.equal(nextMarker(MARKERS, 0, 1), MARKERS[0]);
  assert.equal(nextMarker(MARKERS, 1, 1), MARKERS[1]);
  assert.equal(nextMarker(MARKERS, 2, 1), MARKERS[3]);
  assert.equal(nextMarker(MARKERS, 5, 1), null);
  assert.equal(nextMarker(MARKERS, 5, -1), MARKERS[2]);
  assert.equal(nextMarker(MARKERS, 1, -1), null);
  assert.equal(nextMarker([], 1, -1), null);
});
