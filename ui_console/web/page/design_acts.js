// Actions of buttons and keys on the chosen element and the draft; they cover everything that dragging can do.

import { ask, choose } from "./design_dialogs.js";
import { notice, titleOf } from "./design_status.js";
import { keyOf, numberOf } from "./design_tree.js";
import { find, queryAll } from "./dom.js";

/** @import { DesignView, ElementRow, ElementView } from "./design_messages.d.ts" */
/** @import { Adding } from "./design_adding.js" */
/** @import { Carrying } from "./design_carrying.js" */
/** @import { Choice } from "./design_choice.js" */
/** @import { Places } from "./design_places.js" */
/** @import { Tree } from "./design_tree.js" */
/** @import { Change, Path, WantedChange } from "./design_types.d.ts" */

const NOT_OF_THE_MISSION = ["up", "down", "into", "out", "carry", "remove"];
/** @type {Record<string, string | undefined>} */
const BY_KEY = {
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
};
/** @type {Record<string, string | undefined>} */
const BY_SHIFTED_KEY = { ArrowUp: "up", ArrowDown: "down" };

export class Acts {
  /**
   * @param {{ tree: Tree, places: Places, choice: Choice, adding: Adding, carrying: Carrying,
   *   view: Partial<DesignView>, change: Change }} given
   */
  constructor({ tree, places, choice, adding, carrying, view, change }) {
    this.tree = tree;
    this.places = places;
    this.choice = choice;
    this.adding = adding;
    this.carrying = carrying;
    this.view = view;
    this.change = change;
    this.buttons = queryAll(find("actions"), "button", HTMLButtonElement);
    this.acts = new Map(Object.entries(this.all()));
    for (const button of this.buttons) button.addEventListener("click", () => this.do(button.dataset.act ?? ""));
    for (const name of ["undo", "redo", "revert", "save"]) find(name).addEventListener("click", () => this.do(name));
    find("save-as").addEventListener("click", () => this.saveAs());
    addEventListener("keydown", (event) => this.pressed(event));
  }

  /** @returns {Record<string, () => void>} */
  all() {
    return {
      add: () => this.choice.whenShown((element) => this.add(element)),
      up: () => this.atChosen((path) => this.beside(path, -1)),
      down: () => this.atChosen((path) => this.beside(path, 1)),
      into: () => this.atChosen((path, row) => this.into(path, row)),
      out: () => this.atChosen((path) => out(path)),
      carry: () => this.carrying.toggle(),
      higher: () => this.raise(1),
      lower: () => this.raise(-1),
      remove: () => this.atChosen((path) => ({ do: "remove", path })),
      undo: () => this.change(() => ({ do: "undo" })),
      redo: () => this.change(() => ({ do: "redo" })),
      revert: () => this.change(() => ({ do: "reread" })),
      save: () => this.change(() => ({ do: "save" })),
    };
  }

  /** @param {string} name */
  do(name) {
    this.acts.get(name)?.();
  }

  /**
   * Carry out a key of the tree; returns whether it has a meaning.
   *
   * @param {KeyboardEvent} event
   */
  doKey(event) {
    const act = BY_KEY[event.key] ?? (event.shiftKey ? BY_SHIFTED_KEY[event.key] : undefined);
    if (act) this.do(act);
    return act !== undefined;
  }

  /**
   * Keys with the same meaning anywhere on the page.
   *
   * @param {KeyboardEvent} event
   */
  pressed(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    if (find("designer").hidden || document.querySelector("dialog[open]")) return;
    const isField = event.target instanceof Element && event.target.closest("input, select, textarea") !== null;
    const key = event.key.toLowerCase();
    if (key === "s") {
      if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
      this.do("save");
    } else if (!isField && key === "z" && !event.shiftKey) this.do("undo");
    else if (!isField && (key === "y" || (key === "z" && event.shiftKey))) this.do("redo");
    else return;
    event.preventDefault();
  }

  /**
   * Enable the buttons whose actions the chosen element allows.
   *
   * @param {ElementView} element
   */
  showFor({ path, properties }) {
    const hasPriority = properties.some((one) => one.name === "priority" && !one.is_parameter && one.value !== null);
    for (const button of this.buttons) {
      const act = button.dataset.act ?? "";
      button.disabled =
        (NOT_OF_THE_MISSION.includes(act) && path.length === 0) ||
        (["higher", "lower"].includes(act) && !hasPriority) ||
        (act === "out" && path.length < 2);
    }
  }

  /**
   * Change the element that is chosen when it is this change's turn.
   *
   * @param {(path: Path, row: ElementRow) => WantedChange | null} make
   */
  atChosen(make) {
    this.change(() => {
      const row = this.tree.row(this.tree.at);
      const wanted = row ? make(this.tree.at, row) : null;
      return wanted && { ...wanted, revision: this.view.status?.revision }; // the choice follows its element
    });
  }

  /** @param {ElementView} element */
  async add({ path, tag, told, offers }) {
    const revision = this.view.status?.revision;
    const option = await choose(`Add to ${tag} ${told}`, offers);
    if (option) await this.adding.add(path, option, revision);
  }

  /** @param {Path} path */
  siblings(path) {
    return path.length ? this.tree.parts(path.slice(0, -1)) : [];
  }

  /**
   * @param {Path} path
   * @param {-1 | 1} step
   * @returns {WantedChange | null}
   */
  beside(path, step) {
    const all = this.siblings(path);
    const other = all[all.findIndex((one) => keyOf(one.path) === keyOf(path)) + step];
    if (!other) return null;
    const before = numberOf(other.path) + (step > 0 ? 1 : 0);
    return { do: "move", path, parent: path.slice(0, -1), before };
  }

  /**
   * @param {Path} path
   * @param {ElementRow} row
   * @returns {WantedChange | null}
   */
  into(path, row) {
    const above = this.siblings(path).filter((one) => numberOf(one.path) < numberOf(path));
    const holder = above.filter((one) => this.places.mayHold(one.path, row.tag)).at(-1);
    if (holder) return { do: "move", path, parent: holder.path, before: null };
    notice("Nothing above it can hold it", "");
    return null;
  }

  /** @param {number} steps */
  raise(steps) {
    this.choice.whenShown(() =>
      this.atChosen((path) => {
        const found = this.view.element?.properties.find((one) => one.name === "priority" && !one.is_parameter);
        const value = Number.parseInt(found?.value ?? "", 10);
        return Number.isNaN(value) ? null : { do: "set", path, name: "priority", value: String(value + steps) };
      }),
    );
  }

  async saveAs() {
    if (!this.view.status) return;
    const proposed = titleOf(this.view.status);
    const answers = await ask("Save as", "Another file of the same folder, which is designed from then on.", [
      { name: "file", doc: "Ends in .xml.", proposed, choices: [], is_required: true },
    ]);
    if (answers === null) return;
    const [name] = answers;
    if (name === proposed) this.do("save");
    else this.change(() => ({ do: "save", name }));
  }
}

/**
 * @param {Path} path
 * @returns {WantedChange | null}
 */
function out(path) {
  if (path.length < 2) return null;
  const parent = path.slice(0, -1);
  return { do: "move", path, parent: parent.slice(0, -1), before: numberOf(parent) + 1 };
}
