// Where parts and elements may go in the designer's tree.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Places } from "../../../../ui_console/web/page/design_places.js";
import { keyOf } from "../../../../ui_console/web/page/design_tree.js";

const ROWS = [
  { path: [], tag: "mission" },
  { path: [1], tag: "behaviors" },
  { path: [1, 0], tag: "behavior" },
  { path: [1, 0, 2], tag: "arc" },
  { path: [1, 1], tag: "behavior" },
  { path: [2], tag: "resources" },
];
const PLACES = { behaviors: ["behavior"], behavior: ["behavior", "arc"], arc: ["wish"], resources: ["resource"] };

/** @param {number[]} path */
const at = (path) => ({ dataset: { key: keyOf(path) } });

function stage() {
  const tree = {
    row: (path) => ROWS.find((row) => keyOf(row.path) === keyOf(path)),
    parts: (path) => ROWS.filter((row) => row.path.length && keyOf(row.path.slice(0, -1)) === keyOf(path)),
    node: at,
  };
  const said = [];
  const view = { places: PLACES, status: { revision: 7 } };
  return { said, places: new Places({ tree, view, change: (make) => said.push(make()) }) };
}

test("a wish let go of on a behavior is for its ARC, a behavior for the mission", () => {
  const { places, said } = stage();
  const wish = { label: "wish scout", tag: "wish", told: "wish scout", revision: 7 };
  places.place(wish, at([1, 0]), "after").do();
  assert.deepEqual(said[0], { do: "take", path: [1, 0], label: "wish scout", answers: [], revision: 7 });
  assert.equal(places.place(wish, at([2]), "into"), null);
  assert.deepEqual(places.holderOf("behavior", [2]), []);
});

test("an element goes before, behind or into another, by the number that it gets", () => {
  const { places, said } = stage();
  const what = { path: [1, 1], tag: "behavior", told: "behavior", revision: 7 };
  for (const part of ["before", "after", "into"]) places.place(what, at([1, 0]), part).do();
  assert.deepEqual(
    said.map(({ parent, before }) => [parent, before]),
    [
      [[1], 0],
      [[1], 1],
      [[1, 0], null],
    ],
  );
});

test("an element goes neither into itself nor beside the mission nor where it may not stand", () => {
  const { places } = stage();
  const what = { path: [1, 0], tag: "behavior", told: "behavior", revision: 7 };
  assert.equal(places.place(what, at([1, 0, 2]), "into"), null);
  assert.equal(places.place(what, at([]), "before"), null);
  assert.equal(places.place(what, at([2]), "into"), null);
});

test("what is dragged names the draft that it was taken from", () => {
  const { places } = stage();
  assert.deepEqual(places.dragged({ dataset: { drag: "part", label: "wish scout", tag: "wish" } }), {
    label: "wish scout",
    tag: "wish",
    told: "wish scout",
    revision: 7,
  });
  assert.deepEqual(places.dragged(at([1, 0])).path, [1, 0]);
  assert.equal(places.dragged(at([9])), null);
});
