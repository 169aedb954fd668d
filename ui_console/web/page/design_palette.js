// The parts that can be dragged into the mission.

import { read } from "./design_dialogs.js";
import { keepingFocus, make, makeButton, query } from "./dom.js";

/** @import { PaletteRow } from "./design_messages.d.ts" */

/** `add(label)` adds a part to the chosen element, `learn(type)` looks up its class. */
export class Palette {
  /**
   * @param {{ root: HTMLElement, filter: HTMLInputElement, add: (label: string) => void,
   *   learn: (type: string) => void }} given
   */
  constructor({ root, filter, add, learn }) {
    this.root = root;
    this.filter = filter;
    this.add = add;
    this.learn = learn;
    this.learning = ""; // the type that was looked up last
    /** @type {PaletteRow[]} */
    this.rows = [];
    filter.addEventListener("input", () => this.draw());
    filter.addEventListener("keydown", (event) => {
      const first = query(root, ".part button", HTMLButtonElement);
      if (event.key === "Enter") first?.click();
      if (event.key === "ArrowDown") first?.focus();
    });
  }

  /** @param {PaletteRow[]} rows */
  show(rows) {
    this.rows = rows;
    this.draw();
    const learned = rows.find((row) => this.learning && row.type === this.learning && row.is_known);
    if (!learned) return;
    this.learning = "";
    this.explain(learned);
  }

  draw() {
    const wanted = this.filter.value.trim().toLowerCase();
    /** @type {Map<string, HTMLElement>} */
    const groups = new Map();
    for (const row of this.rows) {
      if (!`${row.label} ${row.group}`.toLowerCase().includes(wanted)) continue;
      const group = groups.get(row.group) ?? make("section");
      if (!groups.has(row.group)) group.append(make("h3", "", row.group));
      group.append(this.made(row));
      groups.set(row.group, group);
    }
    keepingFocus(this.root, () => this.root.replaceChildren(...groups.values()));
  }

  /** @param {PaletteRow} row */
  explain(row) {
    read(row.name, row.doc.join("\n"));
  }

  /** @param {PaletteRow} row */
  about(row) {
    if (row.is_known) this.explain(row);
    else {
      this.learning = row.type;
      this.learn(row.type);
    }
  }

  /** @param {PaletteRow} row */
  made(row) {
    const made = make("div", `part tag-${row.tag}`);
    made.dataset.drag = "part";
    made.dataset.label = row.label;
    made.dataset.tag = row.tag;
    const handle = make("span", "handle", "⠿");
    handle.setAttribute("aria-hidden", "true");
    const about = makeButton("?", () => this.about(row), `about ${row.label}`);
    about.setAttribute("aria-label", `About ${row.label}`);
    const add = makeButton("Add", () => this.add(row.label), `add ${row.label}`);
    add.setAttribute("aria-label", `Add ${row.label}`);
    made.append(handle, make("span", "name", row.name), about, add);
    return made;
  }
}
