// Which behaviors and views a person may choose.

import assert from "node:assert/strict";
import { test } from "node:test";

import { behaviorsOf, chosenOf, picturesOf, toldOf } from "../../../../ui_console/web/page/seen.js";

const difference = { view: "difference", is_picture: true, text: "" };
const threshold = { view: "threshold", is_picture: false, text: "28" };

test("only behaviors that run are offered, in order", () => {
  const there = [
    { address: "mission_control/watch2", state: "ready" },
    { address: "resource_pool/scout1", state: "ready" },
    { address: "mission_control/watch1", state: "connecting" },
    { address: "mission_control/patrol", state: "stopped" },
  ];
  assert.deepEqual(behaviorsOf(there), ["watch1", "watch2"]);
});

test("what is chosen stays while it is there, then the first is chosen", () => {
  assert.equal(chosenOf(["a", "b"], "b"), "b");
  assert.equal(chosenOf(["a", "b"], "c"), "a");
  assert.equal(chosenOf([], "c"), "");
});

test("values are no pictures", () => {
  assert.deepEqual(picturesOf([difference, threshold]), ["difference"]);
});

test("without a picture it says why", () => {
  const seen = { behavior: "watch1", views: [difference], trouble: "" };
  assert.equal(toldOf(seen), "");
  assert.equal(toldOf({ ...seen, behavior: "" }), "no behavior runs");
  assert.equal(toldOf({ ...seen, views: [], trouble: "no answer" }), "no answer");
  assert.match(toldOf({ ...seen, views: [] }), /^watch1 has shown nothing yet/);
});
