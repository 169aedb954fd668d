// A carried element: picked up by a button or a key, and put into the next chosen element.

import { notice } from "./design_status.js";
import { isWithin } from "./design_tree.js";
import { find } from "./dom.js";

/** @import { DesignView } from "./design_messages.d.ts" */
/** @import { Places } from "./design_places.js" */
/** @import { Tree } from "./design_tree.js" */
/** @import { Path } from "./design_types.d.ts" */

export class Carrying {
  /** @param {{ tree: Tree, places: Places, view: Partial<DesignView> }} given */
  constructor({ tree, places, view }) {
    this.tree = tree;
    this.places = places;
    this.view = view;
    /** @type {{ path: Path, tag: string, revision?: number } | null} */
    this.carried = null;
  }

  /** Pick up the chosen element, or drop the carried one. */
  toggle() {
    if (this.carried) this.drop();
    else this.take(this.tree.at);
  }

  /** @param {Path} path */
  take(path) {
    const row = path.length ? this.tree.row(path) : undefined;
    this.carried = row ? { path, tag: row.tag, revision: this.view.status?.revision } : null;
    this.show(row ? `Choose what ${row.tag} ${row.told} goes into, then touch it or press enter.` : "");
  }

  drop() {
    this.carried = null;
    this.show("");
  }

  /** @param {string} text */
  show(text) {
    const isCarrying = this.carried !== null;
    find("carrying").hidden = !isCarrying;
    find("carrying").textContent = text;
    find("carry").setAttribute("aria-pressed", String(isCarrying));
  }

  /**
   * Put the carried element into another one, or beside it; returns whether that was done.
   *
   * @param {Path} path
   */
  put(path) {
    if (this.carried === null) return false;
    const { path: from, tag, revision } = this.carried;
    this.drop();
    const parent = this.places.mayHold(path, tag) ? path : path.slice(0, -1);
    if (isWithin(path, from) || !this.places.mayHold(parent, tag)) {
      notice(`<${tag}> does not belong there`, "Choose another place.");
      return false;
    }
    this.places.move(from, parent, null, revision);
    return true;
  }
}
