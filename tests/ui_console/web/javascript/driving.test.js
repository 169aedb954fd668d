// A gamepad drives only while a shoulder button is held that was pressed for this.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Gamepad } from "../../../../ui_console/web/page/driving.js";

const SHOULDER = 5;

function device(held, axes = [0.5, -1, 0, 0], index = 0) {
  return { index, axes, buttons: Array.from({ length: 16 }, (_none, number) => ({ pressed: held.includes(number) })) };
}

test("the stick alone does nothing, with the shoulder button it drives", () => {
  const pad = new Gamepad(() => {});
  pad.feel(device([]));
  assert.equal(pad.stick, null);
  pad.feel(device([SHOULDER]));
  assert.deepEqual(pad.stick, [1, 0.5]);
  pad.feel(device([SHOULDER], [0.05, 0.05]));
  assert.deepEqual(
    pad.stick.map((one) => one + 0),
    [0, 0],
  );
});

test("what was held from the beginning, or when it was spent, has to be let go and pressed anew", () => {
  const pad = new Gamepad(() => {});
  pad.feel(device([SHOULDER]));
  assert.equal(pad.stick, null);
  pad.feel(device([]));
  pad.feel(device([SHOULDER]));
  assert.notEqual(pad.stick, null);
  pad.spend();
  pad.feel(device([SHOULDER]));
  assert.equal(pad.stick, null);
});

test("a button acts once for each press, and not when it was held while the window was away", () => {
  const did = [];
  const pad = new Gamepad((what) => did.push(what));
  pad.feel(device([3]));
  assert.deepEqual(did, []);
  pad.feel(device([]));
  pad.feel(device([3]));
  pad.feel(device([3]));
  assert.deepEqual(did, ["stop_all"]);
  pad.feel(undefined);
  pad.feel(device([1]));
  assert.deepEqual(did, ["stop_all"]);
});

test("when a gamepad is unplugged, what is held on another one has to be let go and pressed anew", () => {
  const did = [];
  const pad = new Gamepad((what) => did.push(what));
  pad.feel(device([]));
  pad.feel(device([SHOULDER]));
  pad.feel(device([SHOULDER, 9], undefined, 1));
  assert.equal(pad.stick, null);
  assert.deepEqual(did, []);
  pad.feel(device([], undefined, 1));
  pad.feel(device([SHOULDER], undefined, 1));
  assert.notEqual(pad.stick, null);
});

for (const number of [2, 3]) {
  test(`button ${number} stops all robots, because drivers and makers swap the names of these two`, () => {
    /** @type {string[]} */
    const did = [];
    const pad = new Gamepad((what) => did.push(what));
    pad.feel(device([]));
    pad.feel(device([number]));
    assert.deepEqual(did, ["stop_all"]);
  });
}
