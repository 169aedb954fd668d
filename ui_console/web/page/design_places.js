// Places for an element or a part, and the meaning of a drop there.

import { isWithin, numberOf, pathOf } from "./design_tree.js";

/** @import { DesignView } from "./design_messages.d.ts" */
/** @import { Tree } from "./design_tree.js" */
/** @import { Change, Dragged, DropPlace, Path, RowPart } from "./design_types.d.ts" */

const AT_THE_MISSION = ["behavior", "resource", "world", "type"]; // the server puts these elements into their sections

export class Places {
  /** @param {{ tree: Tree, view: Partial<DesignView>, change: Change }} given */
  constructor({ tree, view, change }) {
    this.tree = tree;
    this.view = view;
    this.change = change;
  }

  /**
   * The dragged object of an element of the page; null: unknown.
   *
   * @param {HTMLElement} source
   * @returns {Dragged | null}
   */
  dragged(source) {
    const { drag, label, tag, key } = source.dataset;
    const revision = this.view.status?.revision;
    if (drag === "part") return label && tag ? { label, tag, told: label, revision } : null;
    const row = this.tree.row(pathOf(key));
    return row ? { path: row.path, tag: row.tag, told: `${row.tag} ${row.told}`, revision } : null;
  }

  /**
   * The meaning of a drop here; null: it is not possible.
   *
   * @param {Dragged} what
   * @param {HTMLElement} node
   * @param {RowPart} part
   * @returns {DropPlace | null}
   */
  place(what, node, part) {
    const path = pathOf(node.dataset.key),
      { tag, revision } = what;
    if ("label" in what) {
      const holder = this.holderOf(tag, path);
      const row = holder ? this.tree.node(holder) : null;
      if (!holder || !row) return null;
      return { row, part: "into", do: () => this.take(holder, what.label, [], revision) };
    }
    if (isWithin(path, what.path)) return null;
    const parent = part === "into" ? path : path.slice(0, -1);
    if ((part !== "into" && path.length === 0) || !this.mayHold(parent, tag)) return null;
    const before = part === "into" ? null : numberOf(path) + (part === "after" ? 1 : 0);
    return { row: node, part, do: () => this.move(what.path, parent, before, revision) };
  }

  /**
   * Whether an element may contain an element of this tag.
   *
   * @param {Path} path
   * @param {string} tag
   */
  mayHold(path, tag) {
    const holder = this.tree.row(path);
    return holder !== undefined && (this.view.places?.[holder.tag] ?? []).includes(tag);
  }

  /**
   * The element that gets a drop here: itself, its ARC for a wish, or the nearest ancestor that can hold it.
   *
   * @param {string} tag
   * @param {Path} path
   */
  holderOf(tag, path) {
    for (let depth = path.length; depth >= 0; depth -= 1) {
      const above = path.slice(0, depth);
      if (this.mayHold(above, tag)) return above;
      const arc = this.tree.parts(above).find((one) => one.tag === "arc");
      if (arc && this.mayHold(arc.path, tag)) return above;
    }
    return AT_THE_MISSION.includes(tag) ? [] : null;
  }

  /**
   * @param {Path} path
   * @param {string} label
   * @param {string[]} answers
   * @param {number} [revision]
   */
  take(path, label, answers, revision) {
    this.change(() => ({ do: "take", path, label, answers, revision }));
  }

  /**
   * @param {Path} path
   * @param {Path} parent
   * @param {number | null} before
   * @param {number} [revision]
   */
  move(path, parent, before, revision) {
    this.change(() => ({ do: "move", path, parent, before, revision }));
  }
}
