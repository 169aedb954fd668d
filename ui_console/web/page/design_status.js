// Status line of the designer's page: state of the draft, other designers, and notices.

import { find, makeNotice } from "./dom.js";

/** @import { DraftStatus } from "./design_messages.d.ts" */

const NOTICES = 3;

/**
 * The mission file without its folder.
 *
 * @param {DraftStatus} status
 */
export const titleOf = ({ source }) => source.slice(source.lastIndexOf("/") + 1);

/**
 * Show the state of the draft, and enable the commands it allows.
 *
 * @param {DraftStatus} status
 */
export function showStatus(status) {
  const name = titleOf(status);
  const count = status.problems ? `${status.problems} problem${status.problems === 1 ? "" : "s"}` : "fine";
  find("mission").textContent = name;
  find("state").textContent = `${status.is_changed ? "changed" : "saved"}, ${count}`;
  find("state").className = status.problems ? "failure" : status.is_changed ? "warning" : "success";
  document.title = `${status.is_changed ? "● " : ""}${name} – Mission design`;
  find("undo", HTMLButtonElement).disabled = !status.can_undo;
  find("redo", HTMLButtonElement).disabled = !status.can_redo;
  find("revert", HTMLButtonElement).disabled = !status.is_changed || status.is_new;
  find("save", HTMLButtonElement).disabled = !status.is_changed;
}

/**
 * Show the other designers.
 *
 * @param {string[]} people
 * @param {string} [user] Who this is.
 */
export function showPeople(people, user) {
  const others = people.filter((one, at) => one !== user || at !== people.indexOf(one));
  find("people").textContent = people.length > 1 ? `with ${others.join(", ")}` : "";
}

/**
 * Show a notice until the person closes it, or newer ones need its place; the same one again replaces it.
 *
 * @param {string} text
 * @param {string} remedy
 * @param {"bad" | "good"} [kind]
 */
export function notice(text, remedy, kind = "bad") {
  const root = find("notices"),
    made = makeNotice(kind, remedy ? `${text} (${remedy})` : text);
  for (const one of [...root.children]) if (one.textContent === made.textContent) one.remove();
  root.append(made);
  while (root.children.length > NOTICES) root.children[0].remove();
}
