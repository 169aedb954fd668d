import assert from "node:assert/strict";
import { test } from "node:test";
import { warning } from "../../../../ui_console/web/page/blind.js";

/** @import { Connection } from "../../../../ui_console/web/page/types.d.ts" */

/** @type {Connection} */
const silent = { is: "down", isUp: false, why: "the server is silent", ageMs: 4000 };

test("a page that is cut off says that it cannot stop a robot, and how old its content is", () => {
  const [title, why] = warning(silent, -1, true);
  assert.equal(title, "THIS PAGE CANNOT STOP A ROBOT");
  assert.equal(why, "This page has received nothing for 4 s (the server is silent). The content is that old.");
});

test("a server without a link to the mission is named", () => {
  const [title, why] = warning({ ...silent, is: "fresh", isUp: true }, 3000, true);
  assert.equal(title, "A STOP PRESSED HERE MAY NOT ARRIVE");
  assert.match(why, /^The server has received nothing from the mission for 3 s/);
});

test("a page of a recording has no robot to stop, and says nothing about stops", () => {
  for (const link of [silent, { ...silent, is: /** @type {const} */ ("old"), isUp: true }]) {
    const [title, why] = warning(link, -1, false);
    assert.equal(title, "NO CONNECTION TO THE RECORDING");
    assert.doesNotMatch(`${title} ${why}`, /stop/i);
  }
});
