// One key: the newest message's fields, plots of its numbers, and its picture.

import { keepingFocus, make, makeButton } from "./dom.js";
import { bytesText } from "./key_list.js";
import { Screen } from "./pictures.js";
import { extend, Plot } from "./plot.js";
import { table } from "./table.js";
import { seconds, set } from "./text.js";

/** @import { FieldRow, MessageShown } from "./messages.d.ts" */
/** @import { Picture } from "./types.d.ts" */

const MOST_PLOTS = 4; // chosen: more than fits beside the fields on a screen
const HEADS = ["field", "value"];

/**
 * The text above the fields. Pure.
 *
 * @param {Omit<MessageShown, "rows">} message
 */
export function headOf({ stamp_s, sequence, size_bytes, cause, trouble }) {
  const because = cause ? `, because of ${cause}` : "";
  const but = trouble ? `; ${trouble}` : "";
  return `sent at ${seconds(stamp_s)}, number ${sequence}, ${bytesText(size_bytes)}${because}${but}`;
}

/**
 * The plots after a press on a field's button: its plot is added or removed; if there are too many, the oldest is
 *     removed. Pure.
 *
 * @param {string[]} names
 * @param {string} pressed
 */
export function toggled(names, pressed) {
  if (names.includes(pressed)) return names.filter((one) => one !== pressed);
  return [...names, pressed].slice(-MOST_PLOTS);
}

/** Draws one key; another key needs another one. */
export class KeyView {
  /**
   * @param {{ name: string, head: Element, fields: HTMLElement, plots: HTMLElement, place: HTMLElement,
   *   drawn: (number: number) => void }} given `drawn`: a picture is on the screen.
   */
  constructor({ name, head, fields, plots, place, drawn }) {
    this.head = head;
    this.fields = fields;
    this.place = place;
    this.plotPlace = plots;
    this.screen = new Screen({ name, drawn });
    this.shown = "";
    /** @type {HTMLTableElement | null} */
    this.table = null;
    /** @type {string[]} */
    this.plotted = [];
    /** @type {Map<string, Plot>} */
    this.plots = new Map();
    /** @type {Map<string, [number, number][]>} */
    this.points = new Map();
    set(head, "nothing was said yet since you look");
    for (const one of [fields, plots, place]) one.replaceChildren();
  }

  /** @param {MessageShown} message */
  show(message) {
    set(this.head, headOf(message));
    if (message.has_picture && this.place.firstChild === null) this.place.append(this.screen.root);
    for (const { name, number } of message.rows) {
      if (number === null) continue;
      const points = this.points.get(name) ?? [];
      this.points.set(name, points);
      extend(points, [message.stamp_s, number]);
    }
    this.list(message.rows);
    this.plot();
  }

  /** @param {FieldRow[]} rows */
  list(rows) {
    const shown = rows.map(({ name, number }) => `${name} ${number === null}`).join("\n");
    if (shown !== this.shown || this.table === null) {
      this.shown = shown;
      keepingFocus(this.fields, () => this.make(rows));
    }
    const lines = this.table?.tBodies[0].rows ?? [];
    rows.forEach(({ text }, number) => {
      set(lines[number].cells[1], text);
    });
  }

  /** @param {FieldRow[]} rows */
  make(rows) {
    const lines = rows.map((row) => [this.nameOf(row), make("span")]);
    this.table = table(HEADS, lines);
    this.fields.replaceChildren(this.table);
  }

  /** @param {FieldRow} row */
  nameOf({ name, number }) {
    if (number === null) return name;
    const button = makeButton(
      name,
      () => {
        this.plotted = toggled(this.plotted, name);
        this.press();
        this.plot();
      },
      name,
    );
    button.title = "Plot it over time";
    button.setAttribute("aria-pressed", String(this.plotted.includes(name)));
    return button;
  }

  /** Show which fields are plotted. */
  press() {
    for (const button of this.fields.querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(this.plotted.includes(button.dataset.key ?? "")));
    }
  }

  plot() {
    for (const [name, { root }] of this.plots) {
      if (this.plotted.includes(name)) continue;
      root.remove();
      this.plots.delete(name);
    }
    for (const name of this.plotted) {
      const plot = this.plots.get(name) ?? new Plot(name);
      if (!this.plots.has(name)) this.plotPlace.append(plot.root);
      this.plots.set(name, plot);
      plot.draw(this.points.get(name) ?? []);
    }
  }

  /** @param {Picture} picture */
  saw(picture) {
    this.screen.saw(picture);
  }

  /** @param {number} now */
  age(now) {
    this.place.classList.toggle("is-stale", this.screen.look(now));
  }
}
