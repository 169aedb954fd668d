// Panes of the designer: side by side if there is room, else one at a time.

import { around, find, queryAll, stepped } from "./dom.js";

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
    const next = stepped(event.key, queryAll(list, "[role=tab]", HTMLElement), document.activeElement);
    if (!(next instanceof HTMLElement)) return;
    event.preventDefault();
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
