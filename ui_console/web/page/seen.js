// Debug views: the views of one behavior, and the pictures of one view.

import { make, offer } from "./dom.js";
import { Screen } from "./pictures.js";
import { set } from "./text.js";

/** @import { ComponentState, SeenViews, ViewRow } from "./messages.d.ts" */
/** @import { Picture, Say } from "./types.d.ts" */

const LOOK_EVERY_MS = 250;
const BEHAVIORS = "mission_control/";
const GONE = ["stopped", "failed"];

/**
 * The names of the behaviors that run, sorted. Pure.
 *
 * @param {Pick<ComponentState, "address" | "state">[]} components
 */
export function behaviorsOf(components) {
  return components
    .filter(({ address, state }) => address.startsWith(BEHAVIORS) && !GONE.includes(state))
    .map(({ address }) => address.slice(BEHAVIORS.length))
    .sort();
}

/**
 * The name to choose: the chosen one while it exists, else the first; empty: there is none. Pure.
 *
 * @param {string[]} names
 * @param {string} chosen
 */
export function chosenOf(names, chosen) {
  return names.includes(chosen) ? chosen : (names[0] ?? "");
}

/**
 * The names of the views that show pictures. Pure.
 *
 * @param {Pick<ViewRow, "view" | "is_picture">[]} views
 */
export function picturesOf(views) {
  return views.filter((one) => one.is_picture).map((one) => one.view);
}

/**
 * The text in place of a picture; empty: there is a picture to choose. Pure.
 *
 * @param {Pick<SeenViews, "behavior" | "views" | "trouble">} seen
 */
export function toldOf({ behavior, views, trouble }) {
  if (behavior === "") return "no behavior runs";
  if (trouble) return trouble;
  if (views.length === 0) return `${behavior} has shown nothing yet; it shows something when it is at work`;
  return "";
}

/** Shows the views of the behavior that a person chooses, while the panel is open; a closed one costs nothing. */
export class Seen {
  /**
   * @param {{ panel: HTMLDetailsElement, behavior: HTMLSelectElement, view: HTMLSelectElement, told: Element,
   *   values: HTMLElement, place: HTMLElement, say: Say }} given
   */
  constructor({ panel, behavior, view, told, values, place, say }) {
    this.panel = panel;
    this.behavior = behavior;
    this.view = view;
    this.told = told;
    this.values = values;
    this.place = place;
    this.say = say;
    /** @type {string[]} */
    this.behaviors = [];
    /** @type {SeenViews} */
    this.seen = { behavior: "", views: [], trouble: "" };
    this.asked = "/";
    /** @type {Screen | null} */
    this.screen = null;
    panel.addEventListener("toggle", () => this.look());
    behavior.addEventListener("change", () => this.look());
    view.addEventListener("change", () => this.look());
    setInterval(() => this.age(performance.now()), LOOK_EVERY_MS);
  }

  /** @param {ComponentState[]} components */
  know(components) {
    this.behaviors = behaviorsOf(components);
    fill(this.behavior, this.behaviors);
    this.look();
  }

  /** @param {SeenViews} seen */
  heard(seen) {
    this.seen = seen;
    this.look();
  }

  /** The connection is new, so the server does not know yet what this page watches. */
  again() {
    this.asked = "/";
    this.look();
  }

  /** If the choice has changed, request it, and draw its known data. */
  look() {
    const behavior = this.panel.open ? this.behavior.value : "";
    const isKnown = behavior !== "" && this.seen.behavior === behavior;
    if (isKnown) fill(this.view, picturesOf(this.seen.views));
    else fill(this.view, []);
    const view = isKnown ? this.view.value : "";
    const wanted = `${behavior}/${view}`;
    if (wanted !== this.asked && this.say({ do: "look", behavior, view })) {
      this.asked = wanted;
      this.hang(behavior, view);
    }
    this.view.disabled = this.view.options.length === 0;
    set(this.told, isKnown || behavior === "" ? toldOf({ ...this.seen, behavior }) : "");
    this.list(isKnown ? this.seen.views.filter((one) => !one.is_picture) : []);
  }

  /**
   * Create a new screen, so that no picture of another view appears under this view's name.
   *
   * @param {string} behavior
   * @param {string} view
   */
  hang(behavior, view) {
    this.screen = null;
    this.place.replaceChildren();
    if (view === "") return;
    const stream = `${behavior}/${view}`;
    const name = `${view} of ${behavior}`;
    this.screen = new Screen({ name, drawn: (number) => this.say({ do: "drawn", robot: stream, number }) });
    this.place.append(this.screen.root);
  }

  /** @param {ViewRow[]} rows */
  list(rows) {
    const text = rows.flatMap((row) => [row.view, row.text]);
    const before = [...this.values.children].map((one) => one.textContent);
    if (text.length === before.length && text.every((one, at) => one === before[at])) return;
    this.values.replaceChildren(...text.map((one, at) => make(at % 2 ? "dd" : "dt", "", one)));
  }

  /** @param {Picture} picture */
  saw(picture) {
    if (picture.robot === this.asked) this.screen?.saw(picture);
  }

  /** @param {number} now */
  age(now) {
    if (this.screen !== null) this.place.classList.toggle("is-stale", this.screen.look(now));
  }
}

/**
 * Offer these names; the chosen one stays while it exists.
 *
 * @param {HTMLSelectElement} select
 * @param {string[]} names
 */
function fill(select, names) {
  const chosen = chosenOf(names, select.value);
  offer(select, names);
  if (select.value !== chosen) select.value = chosen;
}
