// Places of the floor on the screen, and what a tap means.

import assert from "node:assert/strict";
import { test } from "node:test";

import { listed, meantBy, Plan, pixelAt, REACH_PX, stepped } from "../../../../ui_console/web/page/map_plan.js";

const FLOOR = { width_m: 6, depth_m: 4, shapes: [], image: "" };

/**
 * @param {string} name
 * @param {number} x_m
 * @param {number} y_m
 */
const body = (name, x_m, y_m, is_robot = true) => ({ name, x_m, y_m, is_robot });

test("a floor is as large as fits, its origin below on the left", () => {
  const wide = new Plan(FLOOR, 600, 4000);
  assert.deepEqual([wide.pxPerM, wide.widthPx, wide.heightPx], [100, 600, 400]);
  assert.deepEqual(wide.at(0, 0), [0, 400]);
  assert.deepEqual(wide.at(6, 4), [600, 0]);
  assert.equal(new Plan(FLOOR, 6000, 200).pxPerM, 50);
  assert.ok(new Plan({ width_m: 0, depth_m: 0 }, 0, 0).pxPerM >= 1);
});

test("the place under a point is where it is drawn, never off the floor", () => {
  const plan = new Plan(FLOOR, 600, 400);
  for (const place of [
    [0, 0],
    [1.25, 3.5],
    [6, 4],
  ]) {
    assert.deepEqual(plan.place(plan.at(place[0], place[1])), place);
  }
  assert.deepEqual(plan.place([-50, 5000]), [0, 0]);
  assert.deepEqual(plan.place([5000, -50]), [6, 4]);
});

test("a finger means the nearest robot within its reach, and the floor farther off", () => {
  const plan = new Plan(FLOOR, 600, 400);
  const bodies = [body("scout1", 1, 1), body("scout2", 1.3, 1), body("guest", 4, 2, false)];
  const [left, top] = plan.at(1, 1);
  assert.equal(plan.robotAt([left + REACH_PX, top], bodies)?.name, "scout2");
  assert.equal(plan.robotAt([left + 8, top], bodies)?.name, "scout1");
  assert.equal(plan.robotAt([left - REACH_PX - 1, top], bodies), null);
  assert.equal(plan.robotAt(plan.at(4, 2), bodies), null, "who is no robot takes no orders");
});

test("arrows move the cross by a step, up is away, and it stays on the floor", () => {
  assert.deepEqual(stepped([1, 1], "ArrowUp", 0.25, FLOOR), [1, 1.25]);
  assert.deepEqual(stepped([1, 1], "ArrowLeft", 0.25, FLOOR), [0.75, 1]);
  assert.deepEqual(stepped([0.1, 4], "ArrowUp", 0.25, FLOOR), [0.1, 4]);
  assert.deepEqual(stepped([0.1, 4], "ArrowLeft", 0.25, FLOOR), [0, 4]);
  assert.equal(stepped([1, 1], "Enter", 0.25, FLOOR), null);
});

test("a point of a box is a pixel of the picture that fits into it, with bars beside or above", () => {
  assert.deepEqual(pixelAt([320, 240], [640, 480], [320, 240]), [159.5, 119.5]);
  assert.deepEqual(pixelAt([0, 0], [640, 480], [320, 240]), [-0.5, -0.5]);
  assert.deepEqual(pixelAt([420, 240], [840, 480], [320, 240]), [159.5, 119.5]);
  assert.equal(pixelAt([50, 240], [840, 480], [320, 240]), null);
  assert.equal(pixelAt([320, 20], [640, 680], [320, 240]), null);
});

test("orders are for the selected robots, else for the one in hand", () => {
  assert.deepEqual(meantBy(new Set(["scout2", "scout1"]), "rover1"), ["scout1", "scout2"]);
  assert.deepEqual(meantBy(new Set(), "rover1"), ["rover1"]);
  assert.deepEqual(meantBy(new Set(), ""), []);
  assert.equal(listed(["a", "b", "c"]), "a, b and c");
  assert.equal(listed(["a"]), "a");
});
