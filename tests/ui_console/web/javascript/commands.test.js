// Which control a field of a command gets, and the value it shows at first.

import assert from "node:assert/strict";
import { test } from "node:test";

import { controlOf, firstOf, stepOf } from "../../../../ui_console/web/page/commands.js";

const UNLIMITED = 1e18;

/**
 * @param {import("../../../../ui_console/web/page/messages.d.ts").ValueKind} kind
 * @param {Partial<import("../../../../ui_console/web/page/messages.d.ts").FieldForm>} more
 */
function field(kind, more = {}) {
  const plain = { least: -UNLIMITED, most: UNLIMITED, default: 0, is_required: false, choices: [] };
  return { kind, ...plain, ...more };
}

test("a number with both limits is a slider, a flag a switch, words a select, anything else is written", () => {
  assert.equal(controlOf(field("number", { least: 0, most: 1 })), "slider");
  assert.equal(controlOf(field("whole", { least: 0, most: 9 })), "slider");
  assert.equal(controlOf(field("number", { least: 0 })), "number");
  assert.equal(controlOf(field("flag")), "switch");
  assert.equal(controlOf(field("text", { choices: ["walk", "trot"] })), "select");
  assert.equal(controlOf(field("text")), "text");
});

test("a slider has a hundred steps, or whole ones", () => {
  assert.equal(stepOf(field("number", { least: 0, most: 1 })), "0.01");
  assert.equal(stepOf(field("whole", { least: 0, most: 1000 })), "1");
  assert.equal(stepOf(field("number")), "any");
});

test("at first a field has its default, or is as near to nothing as it can be", () => {
  assert.equal(firstOf(field("number", { default: 0.5 })), 0.5);
  assert.equal(firstOf(field("number", { is_required: true, least: -1, most: 1 })), 0);
  assert.equal(firstOf(field("number", { is_required: true, least: 2, most: 5 })), 2);
  assert.equal(firstOf(field("flag", { is_required: true })), false);
  assert.equal(firstOf(field("text", { is_required: true, choices: ["walk", "trot"] })), "walk");
});
