// The keys on the bus as a table: message, sender, rate and size.

import { keepingFocus, make, makeButton } from "./dom.js";
import { table } from "./table.js";
import { set } from "./text.js";

/** @import { KeyList, KeyRow } from "./messages.d.ts" */

const HEADS = ["key", "message", "a second", "bytes a second", "bytes each"];

/**
 * The id of a row. Pure.
 *
 * @param {Pick<KeyRow, "key" | "source" | "schema">} row
 */
export function idOf({ key, source, schema }) {
  return `${key} ${source} ${schema}`;
}

/**
 * A number of bytes for people. Pure.
 *
 * @param {number} bytes
 */
export function bytesText(bytes) {
  if (bytes < 1000) return `${Math.round(bytes)} B`;
  if (bytes < 1e6) return `${(bytes / 1000).toFixed(1)} kB`;
  return `${(bytes / 1e6).toFixed(1)} MB`;
}

/**
 * The message's name, and its sender if that is not the component of the key. Pure.
 *
 * @param {Pick<KeyRow, "key" | "source" | "schema">} row
 */
export function messageText({ key, source, schema }) {
  const name = schema || "no message";
  return source && !key.startsWith(`${source}/`) ? `${name} from ${source}` : name;
}

/**
 * The texts of a row behind its key. Pure.
 *
 * @param {KeyRow} row
 */
export function textsOf(row) {
  const rate = row.messages_per_s.toFixed(row.messages_per_s < 10 ? 1 : 0);
  return [messageText(row), rate, bytesText(row.bytes_per_s), bytesText(row.mean_bytes)];
}

/**
 * The text above the list. Pure.
 *
 * @param {Pick<KeyList, "rows" | "matching" | "heard" | "dropped">} list
 */
export function toldOf({ rows, matching, heard, dropped }) {
  if (heard === 0) return "nothing was said yet";
  const shown =
    matching > rows.length ? `${rows.length} of ${matching} shown; words find the others` : `${matching} shown`;
  const few = dropped > 0 ? `; incomplete: ${dropped} messages came too fast` : "";
  return `${heard} heard, ${shown}${few}`;
}

/** Draws the list; an existing row is reused, so that a press on it is not lost. */
export class KeyTable {
  /** @param {{ root: HTMLElement, chosen: (row: KeyRow) => void }} given */
  constructor({ root, chosen }) {
    this.root = root;
    this.chosen = chosen;
    this.shown = "";
    /** @type {HTMLTableElement | null} */
    this.table = null;
  }

  /** @param {KeyRow[]} rows */
  draw(rows) {
    const shown = rows.map(idOf).join("\n");
    if (shown !== this.shown || this.table === null) {
      this.shown = shown;
      keepingFocus(this.root, () => this.make(rows));
    }
    const lines = this.table?.tBodies[0].rows ?? [];
    rows.forEach((row, number) => {
      textsOf(row).forEach((text, cell) => {
        set(lines[number].cells[cell + 1], text);
      });
    });
  }

  /** @param {KeyRow[]} rows */
  make(rows) {
    const lines = rows.map((row) => {
      const button = makeButton(row.key, () => this.chosen(row), idOf(row));
      return [button, ...HEADS.slice(1).map(() => make("span"))];
    });
    this.table = table(HEADS, lines);
    this.root.replaceChildren(this.table);
  }

  /**
   * Put the focus on the row of this name, if it is there.
   *
   * @param {string} id
   */
  focus(id) {
    const row = this.root.querySelector(`[data-key="${CSS.escape(id)}"]`);
    if (row instanceof HTMLElement) row.focus();
  }
}
