// Drawn pictures are confirmed more slowly than a server permits, the newest of each stream in turn.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Confirmations } from "../../../../ui_console/web/page/drawn.js";

/** @param {number} number */
const of = (robot, number) => ({ do: "drawn", robot, number });

test("sixteen robots at thirty pictures a second stay below two hundred messages a second, and none is left out", (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const said = [];
  const confirmations = new Confirmations((message) => said.push(message));
  for (let number = 0; number < 30; number += 1) {
    for (let robot = 0; robot < 16; robot += 1) confirmations.add(of(`scout${robot}`, number));
    for (let ms = 0; ms < 33; ms += 1) t.mock.timers.tick(1);
  }
  assert.ok(said.length < 150, `${said.length} messages`);
  assert.equal(new Set(said.map(({ robot }) => robot)).size, 16);
});

test("a single picture is confirmed at once, and of several of a stream the newest is", (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const said = [];
  const confirmations = new Confirmations((message) => said.push(message));
  confirmations.add(of("scout1", 1));
  confirmations.add(of("scout1", 2));
  confirmations.add(of("scout1", 3));
  assert.deepEqual(said, [of("scout1", 1)]);
  for (let ms = 0; ms < 100; ms += 1) t.mock.timers.tick(1);
  assert.deepEqual(said, [of("scout1", 1), of("scout1", 3)]);
  confirmations.add(of("scout1", 4));
  assert.equal(said.length, 3);
});
