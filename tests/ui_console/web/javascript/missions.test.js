// Links between the missions of one server.

import assert from "node:assert/strict";
import { test } from "node:test";

import { linksTo } from "../../../../ui_console/web/page/missions.js";

test("each mission is found from the page of each other one", () => {
  const [day, night] = linksTo(["day", "night"]);
  assert.deepEqual(day, { name: "day", href: "../day/" });
  assert.equal(new URL(night.href, "http://here:8420/m/day/").href, "http://here:8420/m/night/");
});
