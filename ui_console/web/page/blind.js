// The warning across the screen while this page cannot stop a robot, or its content is old.

import { set } from "./text.js";

/** @import { Connection } from "./types.d.ts" */

const LOOK_EVERY_MS = 250;

/**
 * Returns title and text of the warning; a recording has no robots to stop.
 *
 * @param {Connection} link
 * @param {number} hubAgeMs Time from which the server has no link to the mission; negative: it has a link.
 * @param {boolean} isLive
 */
export function warning(link, hubAgeMs, isLive) {
  const since = (/** @type {number} */ ageMs) => `${Math.max(1, Math.round(ageMs / 1000))} s`;
  const silence = `This page has received nothing for ${since(link.ageMs)} (${link.why}).`;
  if (!isLive) return ["NO CONNECTION TO THE RECORDING", silence];
  const title = link.isUp ? "A STOP PRESSED HERE MAY NOT ARRIVE" : "THIS PAGE CANNOT STOP A ROBOT";
  if (link.is !== "fresh") return [title, `${silence} The content is that old.`];
  const nothing = `The server has received nothing from the mission for ${since(hubAgeMs)}.`;
  return [title, `${nothing} The content is older.`];
}

/**
 * Shows that the page is cut off, for how long, and other means to stop robots; the page is gray meanwhile. A server
 * without a link to the mission also counts, because its page cannot stop a robot.
 */
export class Blindness {
  /**
   * @param {{ link: Connection, root: HTMLElement, title: Element, why: Element, areas: HTMLElement[],
   *   stops: () => Iterable<HTMLButtonElement>, isLive: () => boolean }} given
   */
  constructor({ link, root, title, why, areas, stops, isLive }) {
    this.link = link;
    this.root = root;
    this.title = title;
    this.why = why;
    this.areas = areas;
    this.stops = stops;
    this.isLive = isLive;
    this.hubAgeMs = -1;
    this.wasUp = false;
    setInterval(() => this.look(), LOOK_EVERY_MS);
  }

  /**
   * Time from which the server has no link to the mission, in milliseconds; negative: it has a link.
   *
   * @param {number} ageMs
   */
  hub(ageMs) {
    this.hubAgeMs = ageMs;
    this.look();
  }

  look() {
    const { is, isUp } = this.link;
    this.wasUp = this.wasUp || isUp;
    const isBlind = this.wasUp && (is !== "fresh" || this.hubAgeMs >= 0);
    document.body.classList.toggle("is-blind", isBlind);
    this.root.hidden = !isBlind;
    for (const area of this.areas) area.inert = this.wasUp && !isUp;
    for (const stop of this.stops()) stop.disabled = !isUp;
    if (!isBlind) return;
    const [title, why] = warning(this.link, this.hubAgeMs, this.isLive());
    set(this.title, title);
    set(this.why, why);
  }
}
