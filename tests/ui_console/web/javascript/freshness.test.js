// How old what is shown can be: whatever comes back late, out of order or never.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Freshness, makeClock } from "../../../../ui_console/web/page/freshness.js";

test("the age counts from the newest beat that came back", () => {
  const one = new Freshness();
  one.begin(1000);
  assert.equal(one.age(1200), 200);
  const [first, second, third] = [one.beat(1250), one.beat(1500), one.beat(1750)];
  one.returned(second);
  assert.equal(one.age(1800), 300);
  one.returned(first);
  assert.equal(one.age(1800), 300);
  one.returned(99);
  assert.equal(one.age(1900), 400);
  one.returned(third);
  assert.equal(one.age(9000), 7250);
});

test("while a page does not run, the server is not silent", () => {
  const one = new Freshness();
  one.begin(1000);
  one.ran(1100);
  one.beat(1100);
  one.ran(4600); // half a second of it counts as run
  assert.deepEqual([one.age(4600), one.silence(4600)], [3600, 600]);
  const next = one.beat(4600);
  for (let now = 4700; now <= 6500; now += 100) one.ran(now);
  assert.equal(one.silence(6500), 2500);
  one.returned(next);
  assert.equal(one.silence(6500), 1900);
});

test("a page that always runs late hears of a silent server, too", () => {
  const one = new Freshness();
  one.begin(0);
  for (let now = 600; now <= 6000; now += 600) one.ran(now);
  assert.equal(one.silence(6000), 5000);
});

test("before anything was heard it is older than any limit", () => {
  assert.equal(new Freshness().age(0), Infinity);
});

test("a clock goes on while the device sleeps, and is not set back", () => {
  let [steady, wall] = [0, 5000];
  const clock = makeClock(
    () => steady,
    () => wall,
  );
  wall += 60_000;
  assert.equal(clock(), 60_000);
  steady += 100;
  wall -= 3_600_000;
  assert.equal(clock(), 60_100);
});
