// Panes of the designer: beside each other where there is room, one at a time where there is not.

import { around, find, queryAll } from "./dom.js";

/** @type {Record<string, number | undefined>} */
const STEPS = { ArrowLeft: -1, ArrowRight: 1 };

/** Shows the panes that tabs choose; `rehearse(isShown)` is called when the first minute comes into sight or leaves. */
export class Panes {
  /** @param {{ rehearse: (isShown: boolean) => void }} given */
  constructor({ rehearse }) {
    this.rehearse = rehearse;
    for (const list of [find("panes"), find("below-tabs")]) {
      list.addEventListener("click", (event) => this.press(around(event, "[role=tab]")));
      list.addEventListener("keydown", (event) => this.step(list, event));
    }
  }

  /** @param {string} pane */
  show(pane) {
    document.body.dataset.pane = pane;
    mark("#panes", pane);
    if (pane !== "problems" && pane !== "minute") return;
    mark("#below-tabs", pane);
    const isMinute = pane === "minute";
    if (isMinute === find("minute").hidden) this.rehearse(isMinute);
    find("minute").hidden = !isMinute;
    find("problems").hidden = isMinute;
  }

  /** @param {HTMLElement | null} tab */
  press(tab) {
    if (tab?.dataset.pane) this.show(tab.dataset.pane);
  }

  /**
   * @param {HTMLElement} list
   * @param {KeyboardEvent} event
   */
  step(list, event) {
    const step = STEPS[event.key];
    const tabs = queryAll(list, "[role=tab]", HTMLElement);
    const active = document.activeElement;
    const at = active instanceof HTMLElement ? tabs.indexOf(active) : -1;
    if (!step || at < 0) return;
    event.preventDefault();
    const next = tabs[(at + step + tabs.length) % tabs.length];
    next.focus();
    this.press(next);
  }
}

/**
 * @param {string} list
 * @param {string} pane
 */
function mark(list, pane) {
  for (const tab of document.querySelectorAll(`${list} [role=tab]`)) {
    tab.setAttribute("aria-selected", String(tab.getAttribute("data-pane") === pane));
  }
}
