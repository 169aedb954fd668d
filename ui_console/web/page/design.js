// The designer's page: joins the connection, the parts, the tree, the details, and what lies below.

import { Changes } from "./design_changes.js";
import { ask, choose, read } from "./design_dialogs.js";
import { Drag } from "./design_drag.js";
import { Details, Palette, showMinute, showProblems } from "./design_panels.js";
import { Panes } from "./design_panes.js";
import { notice, showPeople, showStatus } from "./design_status.js";
import { isWithin, keyOf, pathOf, Tree } from "./design_tree.js";
import { Link } from "./link.js";
import { Login } from "./login.js";
import { followTheme } from "./theme.js";

const OLD_MS = 2000,
  SILENT_MS = 5000; // chosen: nothing moves here; a check of a large mission takes a moment
const AT_THE_MISSION = ["behavior", "resource", "world", "type"]; // what the server puts in the right section by itself
const find = (id) => document.getElementById(id);
const view = {};

const link = new Link({ heard, saw: () => {}, changed, silentMs: SILENT_MS, oldMs: OLD_MS });
const login = new Login({ form: find("login"), enter: (hello) => link.open(hello) });
const tree = new Tree({
  root: find("tree"),
  choose: (path, isTouched) => {
    if (!isTouched || !put(path)) link.say({ do: "select", path, number: ++selects });
  },
  key: treeKey,
});
const palette = new Palette({
  root: find("palette"),
  filter: find("find-part"),
  read,
  add: (label) => take(tree.at, label),
  learn: (type) => {
    learning = type;
    link.say({ do: "look_up", type });
  },
});
const details = new Details({
  form: find("properties"),
  set: (path, one, value) => change(() => ({ do: "set", path, name: one.name, value, is_parameter: one.is_parameter })),
});
new Drag({ tree: tree.root, what, place, drop: (place) => place.do() });
const changes = new Changes({ say: (message) => link.say(message), revision: () => view.status?.revision, refused });
const change = (make) => changes.add(make);
let carried = null,
  learning = "",
  afterShown = null,
  selects = 0,
  wasDown = true;
const { show } = new Panes({ rehearse: (is_shown) => link.say({ do: "rehearse", is_shown }) });
followTheme(find("theme"));

// ---------------------------------------------------------------- what is refused, and what has to be asked
let asked = null; // the questions of the dialog whose answers were said last

/** What was said last is not done: say so where it was meant. */
function refused(text, remedy) {
  const { underway } = changes;
  const why = remedy ? `${text} (${remedy})` : text;
  if (underway?.do === "set") details.refused(underway.path, underway, underway.value, why);
  if (underway?.do === "take" && underway.answers?.length && asked?.label === underway.label) askAgain(underway, why);
  else notice(text, remedy);
}

async function askAgain({ path, label, answers }, why) {
  const asks = asked.asks.map((one, number) => ({ ...one, proposed: answers[number] }));
  const revision = view.status.revision;
  const again = await ask(label, asked.doc, asks, why);
  if (again) take(path, label, again, revision);
}

/** Ask what an offer needs to know; resolves to the answers, or null. */
function askFor(offer) {
  asked = offer;
  return offer.asks.length ? ask(offer.label, offer.doc, offer.asks) : Promise.resolve([]);
}

const take = (path, label, answers = [], revision = null) =>
  change(() => ({ do: "take", path, label, answers, ...(revision === null ? {} : { revision }) }));
const atChosen = (make) => change(() => (tree.row(tree.at) ? make(tree.at, tree.row(tree.at)) : null));

// ---------------------------------------------------------------- what is heard
function changed({ is, why }) {
  const shown = find("link");
  shown.classList.toggle("is-down", is !== "fresh");
  shown.textContent = is === "fresh" ? "connected" : is === "old" ? `NOT HEARD: ${why}` : `NOT CONNECTED: ${why}`;
  if (is === "old") return;
  if (is === "fresh") {
    if (!wasDown) return; // it was only not heard for a moment
    wasDown = false;
    selects = 0;
    find("designer").hidden = false;
    if (!find("minute").hidden) link.say({ do: "rehearse", is_shown: true });
    return;
  }
  wasDown = true;
  changes.drop();
  if (is === "refused") {
    find("designer").hidden = true;
    login.ask(why);
  }
}

function heard(message) {
  if (message.answer) {
    answered(message.answer);
    return;
  }
  const news = message.view;
  Object.assign(view, news);
  if (news.tree) tree.show(view.tree);
  if (news.palette) {
    palette.show(view.palette);
    const learned = learning && view.palette.find((row) => row.type === learning && row.is_known);
    if (learned) {
      learning = "";
      read(learned.name, learned.doc.join("\n"));
    }
  }
  if (news.problems) {
    showProblems(find("problems"), view.problems, (path) => {
      tree.pick(path);
      show("details");
    });
    for (const tab of document.querySelectorAll("[role=tab][data-pane=problems]"))
      tab.textContent = view.problems.length ? `Problems (${view.problems.length})` : "Problems";
  }
  if ((news.element || news.selected !== undefined) && view.selected === selects) showChosen(); // else a newer choice is on its way
  if ((news.element || news.tree) && view.element)
    details.show(view.element, tree.row(view.element.path)?.problems ?? []);
  if ("rehearsal" in news) showMinute(find("minute"), view.rehearsal);
  if (news.people) showPeople(view.people, view.welcome?.user);
  if (news.status) showStatus(view.status);
  if (news.handled !== undefined) changes.handled();
}

function showChosen() {
  tree.mark(view.element.path);
  showActions();
  find("target-shown").textContent = `${view.element.tag} ${view.element.told}`.trim();
  const act = afterShown;
  afterShown = null;
  act?.();
}

async function answered(answer) {
  if (answer.ask) {
    const revision = view.status.revision;
    const answers = await askFor(answer.ask);
    if (answers) take(answer.path, answer.ask.label, answers, revision);
  } else if (answer.refused && answer.is_change) refused(answer.refused, answer.remedy);
  else if (answer.refused) notice(answer.refused, answer.remedy);
  else if (answer.notice) notice(answer.notice, answer.remedy);
  else if (answer.text !== undefined) read(answer.source, answer.text, answer.line);
  else if (answer.saved)
    notice(
      answer.problems
        ? `Saved as ${answer.saved}, with problems: ${answer.problems}`
        : `Saved as ${answer.saved}; check says that it is fine.`,
      "",
      "good",
    );
  else if (answer.file_changed) {
    const option = await choose(answer.file_changed, [
      {
        label: "Overwrite it",
        doc: "What somebody else wrote there is gone.",
        act: () => change(() => ({ do: "save", name: answer.name, overwrite: true })),
      },
      ...(answer.name
        ? []
        : [{ label: "Take what the file holds", doc: "Your changes can be had again by Undo.", act: acts.revert }]),
      { label: "Save under another name", doc: "Both are kept.", act: saveAs },
    ]);
    option?.act();
  }
}

// ---------------------------------------------------------------- dragging
function what(source) {
  if (source.dataset.drag === "part")
    return {
      label: source.dataset.label,
      tag: source.dataset.tag,
      told: source.dataset.label,
      revision: view.status.revision,
    };
  const row = tree.row(pathOf(source.dataset.key));
  return { path: row.path, tag: row.tag, told: `${row.tag} ${row.told}`, revision: view.status.revision };
}

/** What it would mean to let go of something here. */
function place(what, node, part) {
  const path = pathOf(node.dataset.key);
  if (what.label) {
    const holder = holderOf(what.tag, path);
    const made = holder && tree.node(holder);
    return made ? { row: made, part: "into", do: () => take(holder, what.label, [], what.revision) } : null;
  }
  if (isWithin(path, what.path)) return null;
  const parent = part === "into" ? path : path.slice(0, -1);
  if ((part !== "into" && path.length === 0) || !mayHold(parent, what.tag)) return null;
  if (part === "into") return { row: node, part, do: () => move(what.path, parent, null, what.revision) };
  return {
    row: node,
    part,
    do: () => move(what.path, parent, path.at(-1) + (part === "after" ? 1 : 0), what.revision),
  };
}

const mayHold = (path, tag) => (view.places[tree.row(path)?.tag] ?? []).includes(tag);

/** The element that gets what is let go of here: itself, its ARC for a wish, or the nearest above that can hold it. */
function holderOf(tag, path) {
  for (let depth = path.length; depth >= 0; depth -= 1) {
    const above = path.slice(0, depth);
    if (mayHold(above, tag)) return above;
    const arc = tree.parts(above).find((one) => one.tag === "arc");
    if (arc && mayHold(arc.path, tag)) return above;
  }
  return AT_THE_MISSION.includes(tag) ? [] : null;
}

function move(path, parent, before, revision = null) {
  change(() => ({ do: "move", path, parent, before, ...(revision === null ? {} : { revision }) }));
}

// ---------------------------------------------------------------- the same by buttons and keys
const acts = {
  add: () =>
    whenShown(async () => {
      const { path, offers } = view.element,
        revision = view.status.revision;
      const option = await choose(`Add to ${view.element.tag} ${view.element.told}`, offers);
      if (!option) return;
      const answers = await askFor(option);
      if (answers) take(path, option.label, answers, revision);
    }),
  up: () =>
    atChosen((path) => {
      const at = siblings(path).findIndex((one) => keyOf(one.path) === keyOf(path));
      return at > 0 ? placed(path, path.slice(0, -1), siblings(path)[at - 1].path.at(-1)) : null;
    }),
  down: () =>
    atChosen((path) => {
      const at = siblings(path).findIndex((one) => keyOf(one.path) === keyOf(path));
      const next = siblings(path)[at + 1];
      return next ? placed(path, path.slice(0, -1), next.path.at(-1) + 1) : null;
    }),
  into: () =>
    atChosen((path, row) => {
      const before = siblings(path)
        .filter((one) => one.path.at(-1) < path.at(-1) && mayHold(one.path, row.tag))
        .at(-1);
      if (!before) {
        notice("Nothing above it can hold it", "");
        return null;
      }
      return placed(path, before.path, null);
    }),
  out: () => atChosen((path) => (path.length > 1 ? placed(path, path.slice(0, -2), path.at(-2) + 1) : null)),
  carry: () => carry(carried === null ? tree.at : null),
  higher: () => raise(1),
  lower: () => raise(-1),
  remove: () => atChosen((path) => ({ do: "remove", path })),
  undo: () => change(() => ({ do: "undo" })),
  redo: () => change(() => ({ do: "redo" })),
  revert: () => change(() => ({ do: "reread" })),
  save: () => change(() => ({ do: "save" })),
};

const siblings = (path) => (path.length ? tree.parts(path.slice(0, -1)) : []);
const placed = (path, parent, before) => ({ do: "move", path, parent, before });

/** Do something as soon as all about the chosen element has been heard. */
function whenShown(act) {
  if (view.element && view.selected === selects) act();
  else afterShown = act;
}

function raise(steps) {
  whenShown(() =>
    atChosen((path) => {
      const found = view.element.properties.find((one) => one.name === "priority" && !one.is_parameter);
      const value = Number.parseInt(found?.value ?? "", 10);
      return Number.isNaN(value) ? null : { do: "set", path, name: "priority", value: String(value + steps) };
    }),
  );
}

/** Take an element in the hand, to be put into the one that is chosen next; null: put nothing. */
function carry(path) {
  const row = path === null || path.length === 0 ? null : tree.row(path);
  carried = row === null || row === undefined ? null : { path, tag: row.tag, revision: view.status.revision };
  find("carrying").hidden = carried === null;
  find("carrying").textContent = carried
    ? `Choose what ${row.tag} ${row.told} goes into, then touch it or press enter.`
    : "";
  document.querySelector("[data-act=carry]").setAttribute("aria-pressed", String(carried !== null));
}

function put(path) {
  if (carried === null) return false;
  const { path: from, tag, revision } = carried;
  carry(null);
  const parent = mayHold(path, tag) ? path : path.slice(0, -1);
  if (isWithin(path, from) || !mayHold(parent, tag)) {
    notice(`<${tag}> does not belong there`, "Choose another place.");
    return false;
  }
  move(from, parent, null, revision);
  return true;
}

function showActions() {
  const { path, properties } = view.element;
  const has = (name) => properties.some((one) => one.name === name && !one.is_parameter && one.value !== null);
  for (const button of document.querySelectorAll("#actions button")) {
    const act = button.dataset.act;
    button.disabled =
      (["up", "down", "into", "out", "carry", "remove"].includes(act) && path.length === 0) ||
      (["higher", "lower"].includes(act) && !has("priority")) ||
      (act === "out" && path.length < 2);
  }
}

function treeKey(event) {
  const act =
    {
      "+": "higher",
      "-": "lower",
      Delete: "remove",
      x: "remove",
      ">": "into",
      "<": "out",
      a: "add",
      u: "undo",
      U: "redo",
      m: "carry",
    }[event.key] ?? (event.shiftKey ? { ArrowUp: "up", ArrowDown: "down" }[event.key] : undefined);
  if (act) acts[act]();
  else if (event.key === "Escape" && carried) carry(null);
  else if (event.key === "Enter" && carried) put(tree.at);
  else if (event.key === "Enter") {
    show("details");
    find("properties").querySelector("input, select")?.focus();
  } else return false;
  return true;
}

addEventListener("keydown", (event) => {
  if (
    !(event.ctrlKey || event.metaKey) ||
    event.altKey ||
    find("designer").hidden ||
    document.querySelector("dialog[open]")
  )
    return;
  const isField = event.target.closest("input, select, textarea") !== null;
  const key = event.key.toLowerCase();
  if (key === "s") {
    document.activeElement?.blur();
    acts.save();
  } else if (!isField && key === "z" && !event.shiftKey) acts.undo();
  else if (!isField && (key === "y" || (key === "z" && event.shiftKey))) acts.redo();
  else return;
  event.preventDefault();
});

for (const button of document.querySelectorAll("#actions button"))
  button.addEventListener("click", () => acts[button.dataset.act]());
for (const name of ["undo", "redo", "revert", "save"]) find(name).addEventListener("click", acts[name]);
find("save-as").addEventListener("click", saveAs);
find("text").addEventListener("click", () => link.say({ do: "text" }));

async function saveAs() {
  const proposed = view.status.source.split("/").at(-1);
  const answers = await ask("Save as", "Another file of the same folder, which is designed from then on.", [
    { name: "file", doc: "Ends in .xml.", proposed, choices: [], is_required: true },
  ]);
  if (answers && answers[0] === proposed) acts.save();
  else if (answers) change(() => ({ do: "save", name: answers[0] }));
}

addEventListener("beforeunload", (event) => {
  if (view.status?.is_changed) event.preventDefault();
});
show("problems");
show("tree");
login.begin();
