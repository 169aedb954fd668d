// What a key means: stops are heard everywhere, drives only where nothing is written and no dialog asks.

import assert from "node:assert/strict";
import { test } from "node:test";

import { DRIVES, meaningOf } from "../../../../ui_console/web/page/keys.js";

const key = (name, more = {}) => ({ key: name, code: "", isRepeat: false, hasModifier: false, ...more });
const PLACES = [false, true].flatMap((isText) =>
  [false, true].flatMap((isRed) =>
    [false, true].flatMap((isDialog) => [false, true].map((isHeld) => ({ isText, isRed, isDialog, isHeld }))),
  ),
);

test("x and X stop in every place, are never written, and act once for each press", () => {
  for (const at of PLACES) {
    assert.deepEqual(meaningOf(key("x"), at), { act: "stop_mine", isTaken: true });
    assert.deepEqual(meaningOf(key("X"), at), { act: "stop_all", isTaken: true });
    assert.deepEqual(meaningOf(key("x", { isRepeat: true }), at), { act: "", isTaken: true });
    assert.equal(meaningOf(key("x", { hasModifier: true }), at), null);
  }
});

test("the login of a page that is cut off takes all letters, and nothing else there does", () => {
  for (const at of PLACES) {
    const isWritten = at.isText;
    for (const [name, act] of [
      ["x", "stop_mine"],
      ["X", "stop_all"],
    ]) {
      assert.deepEqual(meaningOf(key(name), { ...at, isCut: true }), isWritten ? null : { act, isTaken: true });
    }
  }
});

test("space and escape halt in every place; escape closes dialogs too, and space is written in a text", () => {
  for (const at of PLACES) {
    assert.deepEqual(meaningOf(key("Escape"), at), { act: "halt", isTaken: false });
    assert.equal(meaningOf(key(" "), at)?.act, "halt");
    if (at.isText || !at.isHeld) assert.equal(meaningOf(key(" "), at)?.isTaken, false);
  }
});

test("drives and speeds are heard only with a robot, outside texts and dialogs", () => {
  for (const at of PLACES) {
    const isHeard = at.isHeld && !at.isText && !at.isDialog;
    for (const code of Object.keys(DRIVES)) {
      assert.deepEqual(meaningOf(key("?", { code }), at), isHeard ? { act: "drive", isTaken: true } : null);
    }
    assert.deepEqual(meaningOf(key("+"), at), isHeard ? { act: "faster", isTaken: true } : null);
  }
});

test("other keys mean what they mean to the browser", () => {
  for (const at of PLACES) assert.equal(meaningOf(key("q", { code: "KeyQ" }), at), null);
});
