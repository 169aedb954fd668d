// The designer's page: connects the socket, the palette, the tree, the details and the panes below.

import { Acts } from "./design_acts.js";
import { Adding } from "./design_adding.js";
import { Carrying } from "./design_carrying.js";
import { Changes } from "./design_changes.js";
import { Choice } from "./design_choice.js";
import { Details, showProblems } from "./design_details.js";
import { choose, read } from "./design_dialogs.js";
import { Drag } from "./design_drag.js";
import { showMinute } from "./design_minute.js";
import { Palette } from "./design_palette.js";
import { Panes } from "./design_panes.js";
import { Places } from "./design_places.js";
import { notice, showPeople, showStatus } from "./design_status.js";
import { Tree } from "./design_tree.js";
import { find, query } from "./dom.js";
import { Link } from "./link.js";
import { Login } from "./login.js";
import { followTheme } from "./theme.js";

/** @import { Answer, DesignView, ElementView, FileChangedAnswer, Heard, ProblemRow } from "./design_messages.d.ts" */
/** @import { SavedAnswer, Said } from "./design_messages.d.ts" */
/** @import { Change } from "./design_types.d.ts" */
/** @import { LinkChange } from "./types.d.ts" */

const OLD_MS = 2000,
  SILENT_MS = 5000; // chosen: no robot moves here, and a check of a large mission takes a moment
/** @type {Partial<DesignView>} */
const view = {};

/** @type {Link<Heard, Said>} */
const link = new Link({ heard, saw: () => {}, changed, silentMs: SILENT_MS, oldMs: OLD_MS });
const login = new Login({ form: find("login", HTMLFormElement), enter: (hello) => link.open(hello) });
const changes = new Changes({
  say: (message) => link.say(message),
  revision: () => view.status?.revision,
  refused,
  busy: (isBusy) => find("designer").setAttribute("aria-busy", String(isBusy)),
});
/** @type {Change} */
const change = (make) => changes.add(make);
const choice = new Choice({ view, say: (message) => link.say(message) });
const tree = new Tree({
  root: find("tree"),
  choose: (path, isTouched) => {
    if (!isTouched || !carrying.put(path)) choice.choose(path);
  },
  key: treeKey,
});
const places = new Places({ tree, view, change });
const carrying = new Carrying({ tree, places, view });
const adding = new Adding({ places, view });
const acts = new Acts({ tree, places, choice, adding, carrying, view, change });
const palette = new Palette({
  root: find("palette"),
  filter: find("find-part", HTMLInputElement),
  add: (label) => places.take(tree.at, label, []),
  learn: (type) => link.say({ do: "look_up", type }),
});
const details = new Details({
  form: find("properties", HTMLFormElement),
  set: (path, { name, is_parameter }, value) => change(() => ({ do: "set", path, name, value, is_parameter })),
});
const panes = new Panes({ rehearse: (isShown) => link.say({ do: "rehearse", is_shown: isShown }) });
new Drag({
  tree: tree.root,
  what: (source) => places.dragged(source),
  place: (what, row, part) => places.place(what, row, part),
});
followTheme(find("theme", HTMLSelectElement));
let wasDown = true;

/**
 * Show a refusal of the last message at its place.
 *
 * @param {string} text
 * @param {string} remedy
 */
function refused(text, remedy) {
  const { underway } = changes;
  const why = remedy ? `${text} (${remedy})` : text;
  if (underway?.do === "set") details.refused(underway.path, underway, underway.value, why);
  if (!adding.isAskedAgain(underway, why)) notice(text, remedy);
}

// ---------------------------------------------------------------- messages of the server
/** @param {LinkChange} to */
function changed({ is, why }) {
  const shown = find("link");
  shown.classList.toggle("is-down", is !== "fresh");
  shown.textContent = is === "fresh" ? "connected" : is === "old" ? `NOT HEARD: ${why}` : `NOT CONNECTED: ${why}`;
  if (is === "old") return;
  if (is === "fresh") {
    if (wasDown) came();
    return;
  } // otherwise the server was only silent for a moment
  wasDown = true;
  changes.drop();
  if (is === "refused") {
    view.status = undefined; // nothing here keeps a person from loading the page again
    find("designer").hidden = true;
    login.ask(why);
  }
}

function came() {
  wasDown = false;
  choice.begin();
  choice.choose(tree.at); // the server begins with the mission itself
  find("designer").hidden = false;
  if (!find("minute").hidden) link.say({ do: "rehearse", is_shown: true });
}

/** @param {Heard} message */
function heard(message) {
  if (message.answer) {
    answered(message.answer);
    return;
  }
  const news = message.view;
  Object.assign(view, news);
  if (news.tree) tree.show(news.tree);
  if (news.palette) palette.show(news.palette);
  if (news.problems) showAllProblems(news.problems);
  const { element } = choice;
  const isChosen = news.element !== undefined || news.selected !== undefined;
  if (element && isChosen) showChosen(element);
  if (element && (isChosen || news.tree)) details.show(element, tree.row(element.path)?.problems ?? []);
  if ("rehearsal" in news) showMinute(find("minute"), news.rehearsal);
  if (news.people) showPeople(news.people, view.welcome?.user);
  if (news.status) showStatus(news.status);
  if (news.handled !== undefined) changes.handled();
}

/** @param {ProblemRow[]} problems */
function showAllProblems(problems) {
  showProblems(find("problems"), problems, (path) => {
    tree.pick(path);
    panes.show("details");
  });
  for (const tab of document.querySelectorAll("[role=tab][data-pane=problems]"))
    tab.textContent = problems.length ? `Problems (${problems.length})` : "Problems";
}

/** @param {ElementView} element */
function showChosen(element) {
  tree.mark(element.path);
  acts.showFor(element);
  find("target-shown").textContent = `${element.tag} ${element.told}`.trim();
  choice.shown(element);
}

/** @param {Answer} answer */
function answered(answer) {
  if ("ask" in answer || ("refused" in answer && answer.is_change)) changes.refuse();
  if ("ask" in answer) adding.add(answer.path, answer.ask, view.status?.revision);
  else if ("refused" in answer) (answer.is_change ? refused : notice)(answer.refused, answer.remedy);
  else if ("notice" in answer) notice(answer.notice, answer.remedy);
  else if ("text" in answer) read(answer.source, answer.text, answer.line);
  else if ("saved" in answer) saved(answer);
  else fileChanged(answer);
}

/** @param {SavedAnswer} answer */
function saved({ saved, problems }) {
  const how = problems ? `, with problems: ${problems}` : "; check says that it is fine.";
  notice(`Saved as ${saved}${how}`, "", "good");
}

/** @param {FileChangedAnswer} answer */
async function fileChanged({ file_changed, name }) {
  const overwrite = {
    label: "Overwrite it",
    doc: "The changes of others in that file are lost.",
    act: () => change(() => ({ do: "save", name, overwrite: true })),
  };
  const take = {
    label: "Take what the file holds",
    doc: "Your changes can be had again by Undo.",
    act: () => acts.do("revert"),
  };
  const save = { label: "Save under another name", doc: "Both are kept.", act: () => acts.saveAs() };
  const option = await choose(file_changed, [overwrite, ...(name ? [] : [take]), save]);
  option?.act();
}

/**
 * Carry out a key in the tree; returns whether it has a meaning.
 *
 * @param {KeyboardEvent} event
 */
function treeKey(event) {
  if (acts.doKey(event)) return true;
  if (event.key === "Escape" && carrying.carried) carrying.drop();
  else if (event.key === "Enter" && carrying.carried) carrying.put(tree.at);
  else if (event.key === "Enter") {
    panes.show("details");
    query(find("properties"), "input, select", HTMLElement)?.focus();
  } else return false;
  return true;
}

find("text").addEventListener("click", () => link.say({ do: "text" }));
addEventListener("beforeunload", (event) => {
  if (view.status?.is_changed) event.preventDefault();
});
panes.show("problems");
panes.show("tree");
login.begin();
