// Messages on the bus: a list of keys, or a view of one key; a closed panel or a hidden page costs nothing.

import { idOf, KeyTable, toldOf } from "./key_list.js";
import { KeyView } from "./key_view.js";
import { set } from "./text.js";

/** @import { KeyList, KeyRow } from "./messages.d.ts" */
/** @import { Picture, Say } from "./types.d.ts" */

const LOOK_EVERY_MS = 250;
const LIST = "/keys";

/** Shows the list; after a press on a key, the key instead, until the person goes back. */
export class BusKeys {
  /**
   * @param {{ panel: HTMLDetailsElement, list: HTMLElement, words: HTMLInputElement, order: HTMLSelectElement,
   *   told: Element, keys: HTMLElement, view: HTMLElement, back: HTMLElement, title: Element, head: Element,
   *   fields: HTMLElement, plots: HTMLElement, place: HTMLElement, say: Say }} given
   */
  constructor(given) {
    this.given = given;
    this.say = given.say;
    this.table = new KeyTable({ root: given.keys, chosen: (row) => this.choose(row) });
    /** @type {KeyRow | null} */
    this.chosen = null;
    /** @type {KeyView | null} */
    this.view = null;
    this.number = 0;
    this.asked = "";
    this.viewed = "";
    given.panel.addEventListener("toggle", () => this.look());
    given.words.addEventListener("input", () => this.look());
    given.order.addEventListener("change", () => this.look());
    given.back.addEventListener("click", () => this.goBack());
    document.addEventListener("visibilitychange", () => this.look());
    setInterval(() => this.view?.age(performance.now()), LOOK_EVERY_MS);
  }

  /** The connection is new, so the server does not know yet what this page watches. */
  again() {
    this.asked = this.viewed = "";
    this.look();
  }

  /** Request the watched list or key, if it has changed. */
  look() {
    const { panel, words, order } = this.given;
    const isSeen = panel.open && !document.hidden;
    this.list(isSeen && this.chosen === null, words.value, order.value === "bytes" ? "bytes" : "key");
    this.ask(isSeen ? this.chosen : null);
  }

  /**
   * @param {boolean} isOpen
   * @param {string} words
   * @param {"bytes" | "key"} order
   */
  list(isOpen, words, order) {
    const wanted = isOpen ? `${order} ${words}` : "";
    if (wanted === this.asked) return;
    const wish = isOpen ? { is_open: true, words, order } : { is_open: false };
    if (this.say({ do: "list_keys", ...wish })) this.asked = wanted;
  }

  /** @param {KeyRow | null} row */
  ask(row) {
    const wanted = row === null ? "" : idOf(row);
    if (wanted === this.viewed) return;
    const { key = "", source = "", schema = "" } = row ?? {};
    if (this.say({ do: "view_key", number: this.number + 1, key, source, schema })) {
      this.number += 1;
      this.viewed = wanted;
    }
  }

  /** @param {KeyRow} row */
  choose(row) {
    const { list, view, back, title, head, fields, plots, place } = this.given;
    this.chosen = row;
    list.hidden = true;
    view.hidden = false;
    title.textContent = `${row.key} · ${row.schema || "no message"}`;
    const drawn = (/** @type {number} */ number) => this.drawn(`/picture/${this.number}`, number);
    this.view = new KeyView({ name: row.key, head, fields, plots, place, drawn });
    back.focus();
    this.look();
  }

  goBack() {
    const before = this.chosen;
    this.chosen = this.view = null;
    this.given.list.hidden = false;
    this.given.view.hidden = true;
    this.look();
    if (before !== null) this.table.focus(idOf(before));
  }

  /**
   * @param {string} stream
   * @param {number} number
   */
  drawn(stream, number) {
    this.say({ do: "drawn", robot: stream, number });
  }

  /**
   * Handle the server's data for the list or the open view.
   *
   * @param {Picture} packet
   */
  saw(packet) {
    const { robot: stream, number, jpeg } = packet;
    if (stream === `/picture/${this.number}`) {
      this.view?.saw(packet);
      return;
    }
    const said = () => JSON.parse(new TextDecoder().decode(jpeg));
    if (stream === LIST && this.chosen === null) this.showList(said());
    else if (stream === `/fields/${this.number}`) this.view?.show(said());
    requestAnimationFrame(() => this.drawn(stream, number));
  }

  /** @param {KeyList} list */
  showList(list) {
    set(this.given.told, toldOf(list));
    this.table.draw(list.rows);
  }
}
