// How what a robot reports is drawn.

import assert from "node:assert/strict";
import { test } from "node:test";

import { drawnAs, hintOf, lineOf } from "../../../../ui_console/web/page/gauges.js";

const battery = { name: "battery", text: "87 %", share: 0.87, is_share: true, flag: null, span: "", doc: "" };
const lift = { ...battery, name: "lift", text: "0.3", share: 0.3, is_share: false, span: "0 to 1", doc: "How far" };
const way = { ...lift, name: "left wheel", text: "12.3 m", share: -1, span: "", doc: "" };
const bumper = { ...way, name: "front bumper", text: "off", flag: false };

test("a flag is a lamp, on or off; a value with a range a bar; all else words", () => {
  assert.equal(drawnAs(bumper), "lamp");
  assert.equal(drawnAs({ ...bumper, flag: true }), "lamp");
  assert.equal(drawnAs(battery), "bar");
  assert.equal(drawnAs({ ...lift, share: 0 }), "bar");
  assert.equal(drawnAs(way), "words");
});

test("the hint has the range and the meaning, as far as they are known", () => {
  assert.equal(hintOf(lift), "0 to 1: How far");
  assert.equal(hintOf({ span: "", doc: "How far" }), "How far");
  assert.equal(hintOf(way), "");
});

test("the card's line has the shares alone", () => {
  assert.equal(lineOf([battery, lift, way, bumper]), "battery 87 %");
  assert.equal(lineOf([lift]), "");
});
