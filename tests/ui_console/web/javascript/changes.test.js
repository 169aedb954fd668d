// Changes of the draft go out one by one, each made when its turn comes.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Changes } from "../../../../ui_console/web/page/design_changes.js";

function stage() {
  const on = { said: [], refusals: [], isUp: true, revision: 1, isBusy: false };
  on.changes = new Changes({
    say: (message) => on.isUp && on.said.push(message) > 0,
    revision: () => on.revision,
    refused: (text) => on.refusals.push(text),
    busy: (isBusy) => {
      on.isBusy = isBusy;
    },
  });
  return on;
}

test("the next is made when the one before it is done, for the revision of then", () => {
  const on = stage();
  on.changes.add(() => ({ do: "undo" }));
  on.changes.add(() => null);
  on.changes.add(() => ({ do: "redo" }));
  assert.deepEqual(on.said, [{ revision: 1, do: "undo" }]);
  on.revision = 2;
  on.changes.handled();
  assert.deepEqual(on.said[1], { revision: 2, do: "redo" });
});

test("it is busy until the last change is done", () => {
  const on = stage();
  on.changes.add(() => ({ do: "undo" }));
  on.changes.add(() => ({ do: "redo" }));
  on.changes.handled();
  assert.equal(on.isBusy, true);
  on.changes.handled();
  assert.equal(on.isBusy, false);
});

test("without a connection the change is refused, and what waits is forgotten", () => {
  const on = stage();
  on.changes.add(() => ({ do: "undo" }));
  on.changes.add(() => ({ do: "redo" }));
  on.isUp = false;
  on.changes.handled();
  assert.equal(on.refusals.length, 1);
  on.isUp = true;
  on.changes.handled();
  assert.equal(on.said.length, 1);
});

test("a change whose answer is lost with the connection is told, and only once", () => {
  const on = stage();
  on.changes.add(() => ({ do: "undo" }));
  on.changes.add(() => ({ do: "redo" }));
  on.changes.drop();
  on.changes.drop();
  assert.deepEqual(on.refusals, ["NOT CONNECTED: it is not known whether this was done"]);
  assert.equal(on.isBusy, false);
  on.changes.add(() => ({ do: "undo" }));
  assert.equal(on.said.length, 2);
});

test("a change that is longer than the server reads is refused, and the next one goes out", () => {
  const on = stage();
  on.changes.add(() => ({ do: "set", path: [], name: "name", value: "ä".repeat(2100), is_parameter: false }));
  on.changes.add(() => ({ do: "undo" }));
  assert.equal(on.refusals.length, 1);
  assert.deepEqual(on.said, [{ revision: 1, do: "undo" }]);
});

test("before the draft is known nothing is said", () => {
  const on = stage();
  on.revision = undefined;
  on.changes.add(() => ({ do: "undo" }));
  assert.deepEqual(on.said, []);
});

test("a change that was meant for an older draft says so when its turn comes", () => {
  const on = stage();
  on.changes.add(() => ({ do: "move", path: [2], parent: [0], before: null, revision: 1 }));
  on.changes.add(() => ({ do: "remove", path: [2], revision: undefined }));
  on.revision = 2;
  on.changes.handled();
  assert.deepEqual(on.said[0], { revision: 1, do: "move", path: [2], parent: [0], before: null });
  assert.deepEqual(on.said[1], { revision: 2, do: "remove", path: [2] });
});

test("a change that waits while another designer changes the draft is not sent for the new draft", () => {
  const on = stage();
  on.changes.add(() => ({ do: "undo" }));
  on.changes.add(() => ({ do: "set", path: [2], name: "x-m", value: "1", is_parameter: false }));
  on.revision = 3; // the own change, and at once another designer's
  on.changes.handled();
  assert.equal(on.said[1].revision, 2);
});

test("a change that waits behind a refused one stays meant for the draft that its author saw", () => {
  const on = stage();
  on.changes.add(() => ({ do: "undo" }));
  on.changes.add(() => ({ do: "set", path: [2], name: "x-m", value: "1", is_parameter: false }));
  on.revision = 2; // another designer's
  on.changes.refuse();
  on.changes.handled();
  assert.equal(on.said[1].revision, 1);
});

test("changes in a row are meant for what the ones before them made", () => {
  const on = stage();
  for (let number = 0; number < 4; number += 1)
    on.changes.add(() => ({ do: "take", path: [], label: "x", answers: [] }));
  for (const revision of [2, 3, 3, 4]) {
    on.revision = revision; // the third one has no effect
    on.changes.handled();
  }
  assert.deepEqual(
    on.said.map((one) => one.revision),
    [1, 2, 3, 3],
  );
});
