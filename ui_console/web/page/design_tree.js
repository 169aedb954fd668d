// The tree of the mission: rows, one of them chosen, folded or not, with keys to move.

import { around, make, query, queryAll } from "./dom.js";

/** @import { ElementRow } from "./design_messages.d.ts" */
/** @import { Path } from "./design_types.d.ts" */

const FOLDED_AT_FIRST = ["core", "types"]; // elements that are the same in most missions, or that additions fill

/** @param {Path} path */
export const keyOf = (path) => path.join("/");

/**
 * @param {string} [key] The mission itself has none.
 * @returns {Path}
 */
export const pathOf = (key) => (key ? key.split("/").map(Number) : []);

/**
 * The number of an element in its parent.
 *
 * @param {Path} path
 */
export const numberOf = (path) => path.at(-1) ?? 0; // the mission itself has no parent

/**
 * @param {Path} path
 * @param {Path} above
 */
export const isWithin = (path, above) =>
  above.every((number, depth) => path[depth] === number) && path.length >= above.length;

/**
 * A folded element stays folded when it is moved.
 *
 * @param {ElementRow} row
 */
const nameOf = (row) => `${row.path.length} ${row.tag} ${row.told}`;

/**
 * Shows rows; `choose(path, isTouched)` is called when a pointer or a key chooses one, `key(event)` for keys that the
 * tree does not know; it returns whether the key had a meaning.
 */
export class Tree {
  /**
   * @param {{ root: HTMLElement, choose: (path: Path, isTouched: boolean) => void,
   *   key: (event: KeyboardEvent) => boolean }} given
   */
  constructor({ root, choose, key }) {
    this.root = root;
    this.choose = choose;
    this.key = key;
    /** @type {ElementRow[]} */
    this.rows = [];
    /** @type {Map<string, ElementRow>} */
    this.byKey = new Map();
    /** @type {Map<string, ElementRow[]>} */
    this.inside = new Map();
    /** @type {Path} */
    this.at = [];
    /** @type {Set<string>} */
    this.unfolded = new Set();
    /** @type {Set<string>} */
    this.folded = new Set();
    root.addEventListener("click", (event) => {
      const row = around(event, ".element");
      if (!row) return;
      if (around(event, ".fold")) this.fold(pathOf(row.dataset.key));
      this.pick(pathOf(row.dataset.key), true);
    });
    root.addEventListener("keydown", (event) => this.pressed(event));
  }

  /** @param {Path} path */
  row(path) {
    return this.byKey.get(keyOf(path));
  }

  /** @param {Path} path */
  parts(path) {
    return this.inside.get(keyOf(path)) ?? [];
  }

  /** @param {Path} path */
  node(path) {
    return query(this.root, `[data-key="${keyOf(path)}"]`, HTMLElement);
  }

  /** @param {ElementRow} row */
  isFolded(row) {
    if (this.parts(row.path).length === 0) return false;
    if (isFoldedAtFirst(row)) return !this.unfolded.has(row.tag);
    return this.folded.has(nameOf(row));
  }

  /**
   * @param {Path} path
   * @param {boolean} [isFolded] None: the other way round.
   */
  fold(path, isFolded) {
    const row = this.row(path);
    if (!row || path.length === 0) return;
    const folds = isFolded ?? !this.isFolded(row);
    if (isFoldedAtFirst(row)) this.unfolded[folds ? "delete" : "add"](row.tag);
    else this.folded[folds ? "add" : "delete"](nameOf(row));
    this.draw();
  }

  /** @param {ElementRow[]} rows */
  show(rows) {
    this.rows = rows;
    this.byKey = new Map(rows.map((row) => [keyOf(row.path), row]));
    this.inside = new Map();
    for (const row of rows) {
      if (row.path.length === 0) continue;
      const above = keyOf(row.path.slice(0, -1));
      this.inside.set(above, [...(this.inside.get(above) ?? []), row]);
    }
    this.draw();
  }

  /**
   * Mark the element that the server reports as chosen.
   *
   * @param {Path} path
   */
  mark(path) {
    const isOther = keyOf(path) !== keyOf(this.at);
    this.at = path;
    for (let depth = 1; depth < path.length; depth += 1) {
      const above = this.row(path.slice(0, depth));
      if (above && this.isFolded(above)) this.fold(above.path, false);
    }
    this.draw();
    if (isOther) this.node(path)?.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {Path} path
   * @param {boolean} [isTouched]
   */
  pick(path, isTouched = false) {
    this.at = path;
    this.draw();
    this.node(path)?.focus({ preventScroll: true });
    this.node(path)?.scrollIntoView({ block: "nearest" });
    this.choose(path, isTouched);
  }

  draw() {
    const hasFocus = this.root.contains(document.activeElement);
    const made = this.shown().map((row) => this.made(row));
    this.root.replaceChildren(...made);
    const chosen = this.node(this.at) ?? made[0];
    if (chosen) {
      chosen.tabIndex = 0;
      if (hasFocus) chosen.focus({ preventScroll: true });
    }
  }

  /** The rows that are not hidden by a folded element. */
  shown() {
    const shown = [];
    /** @type {Path | null} */
    let folded = null;
    for (const row of this.rows) {
      // in the order of the text, so the content of a folded element follows it
      if (folded !== null && isWithin(row.path, folded)) continue;
      shown.push(row);
      folded = this.isFolded(row) ? row.path : null;
    }
    return shown;
  }

  /** @param {ElementRow} row */
  made(row) {
    const isFolded = this.isFolded(row),
      inside = row.path.length ? this.parts(row.path).length : 0, // the mission itself is never folded
      told = `${row.tag} ${row.told}`.trim();
    const made = make("div", `element tag-${row.tag}`);
    made.dataset.key = keyOf(row.path);
    made.dataset.told = told;
    if (row.path.length) made.dataset.drag = "element";
    made.tabIndex = -1;
    made.setAttribute("role", "treeitem");
    made.setAttribute("aria-label", [told, ...row.problems.map((one) => `problem: ${one}`)].join("; "));
    made.setAttribute("aria-level", String(row.path.length + 1));
    made.setAttribute("aria-selected", String(keyOf(row.path) === keyOf(this.at)));
    if (inside) made.setAttribute("aria-expanded", String(!isFolded));
    made.style.setProperty("--depth", String(row.path.length));
    made.append(sign("handle", row.path.length > 1 ? "⠿" : ""), sign("fold", inside ? (isFolded ? "▸" : "▾") : ""));
    if (row.problems.length) {
      const cross = sign("wrong", "✗");
      cross.title = row.problems.join("\n");
      made.append(cross);
    }
    made.append(make("span", "tag", row.tag), make("span", "told", isFolded ? `… ${inside}` : row.told));
    return made;
  }

  /** @param {KeyboardEvent} event */
  pressed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const row = this.row(this.at);
    if (!row) return;
    if (!event.shiftKey && this.step(event.key, row)) event.preventDefault();
    else if (this.key(event)) event.preventDefault();
  }

  /**
   * Carry out a key that moves through the tree; returns whether it has a meaning.
   *
   * @param {string} key
   * @param {ElementRow} row The chosen one.
   */
  step(key, row) {
    const keys = queryAll(this.root, ".element", HTMLElement).map((one) => one.dataset.key ?? "");
    const number = keys.indexOf(keyOf(this.at));
    const to = (/** @type {number} */ next) => {
      if (next >= 0 && next < keys.length) this.pick(pathOf(keys[next]));
    };
    const holds = this.parts(row.path).length > 0;
    if (key === "ArrowDown") to(number + 1);
    else if (key === "ArrowUp") to(number - 1);
    else if (key === "Home") to(0);
    else if (key === "End") to(keys.length - 1);
    else if (key === " ") this.fold(row.path);
    else if (key === "ArrowRight") {
      if (this.isFolded(row)) this.fold(row.path, false);
      else if (holds) to(number + 1);
    } else if (key === "ArrowLeft") {
      if (!this.isFolded(row) && holds && row.path.length) this.fold(row.path, true);
      else if (row.path.length) this.pick(row.path.slice(0, -1));
    } else return false;
    return true;
  }
}

/** @param {ElementRow} row */
const isFoldedAtFirst = (row) => row.path.length === 1 && FOLDED_AT_FIRST.includes(row.tag);

/**
 * An element with other words for a screen reader.
 *
 * @param {string} className
 * @param {string} text
 */
function sign(className, text) {
  const made = make("span", className, text);
  made.setAttribute("aria-hidden", "true");
  return made;
}
