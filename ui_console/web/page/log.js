// The mission's log: the newest events, or the result of a search, which can be saved as a file.

import { find, make, makeButton, offer } from "./dom.js";
import { table } from "./table.js";
import { seconds, set } from "./text.js";

/** @import { FoundEvent, LogFound, LoggedEvent, LogRefused, SearchLog, View } from "./messages.d.ts" */
/** @import { Say } from "./types.d.ts" */

const SHOWN = 100; // chosen: the server's part; more at a touch
const HEADS = ["at", "level", "about", "what", "who", "reported by"];
const FIELDS = /** @type {const} */ (["text", "robot", "person", "level", "since", "until"]);

/**
 * The result so far. Pure: parts go in, the newest event first, in any order of their arrival.
 *
 * The server sends one part after the other, so that an answer of ten thousand events delays no picture.
 */
export class Found {
  /** @param {number} number */
  constructor(number) {
    this.number = number;
    /** @type {FoundEvent[]} */
    this.events = [];
    this.total = this.leftOut = this.since = this.asked = 0;
  }

  /**
   * Add a part; returns whether it is the next one of this search.
   *
   * @param {LogFound} part
   */
  take(part) {
    if (part.number !== this.number || part.first !== this.events.length) return false;
    this.events.push(...part.events);
    [this.total, this.leftOut, this.since, this.asked] = [part.total, part.left_out, part.since_s, part.asked_s];
    return true;
  }

  get isWhole() {
    return this.events.length >= this.total;
  }

  /** One line for people: size and end of the result, and its gaps. */
  line() {
    const count = `${this.total} event${this.total === 1 ? "" : "s"} found, up to ${seconds(this.asked)}`;
    const more = this.leftOut > 0 ? `; ${this.leftOut} older ones are left out, search a shorter time` : "";
    return count + more + (this.since > 0 ? `; nothing from before ${seconds(this.since)} is kept` : "");
  }

  /** The events as JSON lines, the oldest first, as `scout-backbone log --json` has them. */
  lines() {
    return [...this.events]
      .reverse()
      .map((event) => `${JSON.stringify(event)}\n`)
      .join("");
  }
}

/** The search form and its table; `say` sends to the server, `redraw` draws the table anew. */
export class Log {
  /**
   * @param {{ form: HTMLFormElement, status: HTMLElement, exporting: HTMLElement, say: Say, redraw: () => void }} given
   */
  constructor({ form, status, exporting, say, redraw }) {
    this.form = form;
    this.status = status;
    this.say = say;
    this.redraw = redraw;
    this.number = 0;
    /** @type {Found | null} */
    this.found = null;
    /** @type {Found | null} */
    this.underway = null;
    this.isExporting = false;
    this.shown = SHOWN;
    this.mission = "";
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.search();
    });
    form.addEventListener("reset", () => this.forget());
    exporting.addEventListener("click", () => {
      this.isExporting = true;
      this.search();
    });
  }

  /**
   * Update the robots and people that a search can name.
   *
   * @param {Partial<View>} view
   */
  know(view) {
    this.mission = view.welcome?.mission ?? "";
    const robots = (view.robots ?? []).map((robot) => robot.robot);
    const people = new Set((view.log ?? []).map((row) => row.person).filter(Boolean));
    const list = /** @type {HTMLSelectElement} */ (this.field("robot"));
    const before = list.value;
    if (offer(list, robots, 1)) list.value = robots.includes(before) ? before : "";
    offer(find("log-people"), [...people].sort());
  }

  /** @param {string} name */
  field(name) {
    return /** @type {HTMLInputElement | HTMLSelectElement} */ (this.form.elements.namedItem(name));
  }

  search() {
    this.number += 1;
    this.underway = new Found(this.number);
    /** @type {SearchLog} */
    const said = { do: "search_log", number: this.underway.number };
    for (const name of FIELDS) said[name] = this.field(name).value;
    set(this.status, this.say(said) ? "Searching…" : "NOT CONNECTED: nothing was searched.");
  }

  /** Show the newest events. */
  forget() {
    this.found = this.underway = null;
    this.isExporting = false;
    set(this.status, "");
    this.redraw();
  }

  /** Handle the end of the connection: open questions get no answer any more. */
  cut() {
    if (this.underway === null && !this.isExporting) return;
    this.underway = null;
    this.isExporting = false;
    set(this.status, "NOT CONNECTED: search again.");
  }

  /**
   * Handle the server's answer.
   *
   * @param {LogFound | LogRefused} answer
   */
  heard(answer) {
    const search = this.underway ?? this.found;
    if (search === null || answer.number !== search.number) return;
    if ("refused" in answer) {
      this.underway = null;
      this.isExporting = false;
      set(this.status, `${answer.refused}. ${answer.remedy}`);
      return;
    }
    if (!search.take(answer)) return;
    if (this.underway !== null) [this.found, this.underway, this.shown] = [search, null, SHOWN];
    if (this.isExporting && !search.isWhole && answer.events.length) {
      this.fetch(search);
      return;
    }
    set(this.status, search.line());
    if (this.isExporting) this.export(search);
    this.redraw();
  }

  /** @param {Found} found */
  fetch(found) {
    this.say({ do: "more_log", number: found.number, first: found.events.length });
  }

  /** @param {Found} found */
  more(found) {
    this.shown += SHOWN;
    if (this.shown > found.events.length && !found.isWhole) this.fetch(found);
    else this.redraw();
  }

  /** @param {Found} found */
  export(found) {
    this.isExporting = false;
    const file = URL.createObjectURL(new Blob([found.lines()], { type: "application/jsonl" }));
    const link = document.createElement("a");
    link.href = file;
    link.download = `${this.mission}-log-${Math.round(found.asked)}s.jsonl`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(file), 60000);
  }

  /**
   * Returns the events to show: the result, else the newest.
   *
   * @param {LoggedEvent[]} newest
   */
  draw(newest) {
    const rows = this.found === null ? [...newest].reverse() : this.found.events.slice(0, this.shown);
    if (rows.length === 0)
      return [make("p", "", this.found === null ? "nothing yet" : "nothing of that kind happened")];
    const drawn = table(HEADS, rows.map(cells));
    return this.found !== null && this.shown < this.found.total ? [drawn, this.moreButton(this.found)] : [drawn];
  }

  /** @param {Found} found */
  moreButton(found) {
    return makeButton(`Show more of ${found.total}`, () => this.more(found), "log:more");
  }
}

/** @param {LoggedEvent & { time?: string }} row */
function cells(row) {
  const time = row.time ? `${row.time.slice(11, 19)} ` : "";
  return [
    `${time}${seconds(row.at_s)}`,
    make("span", row.level, row.level),
    row.subject,
    row.what,
    row.person,
    row.where,
  ];
}
