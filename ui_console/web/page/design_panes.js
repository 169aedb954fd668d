// Panes of the designer: beside each other where there is room, one at a time where there is not.

const find = (id) => document.getElementById(id);

/** Shows the panes that tabs choose; `rehearse(isShown)` is called when the first minute comes into sight or leaves it. */
export class Panes {
  constructor({ rehearse }) {
    this.rehearse = rehearse;
    this.show = (pane) => this.choose(pane);
    for (const list of [find("panes"), find("below-tabs")]) {
      list.addEventListener("click", (event) => {
        const tab = event.target.closest("[role=tab]");
        if (tab) this.choose(tab.dataset.pane);
      });
      list.addEventListener("keydown", (event) => this.step(list, event));
    }
  }

  choose(pane) {
    document.body.dataset.pane = pane;
    mark("#panes", pane);
    if (pane !== "problems" && pane !== "minute") return;
    mark("#below-tabs", pane);
    const isMinute = pane === "minute";
    if (isMinute === find("minute").hidden) this.rehearse(isMinute);
    find("minute").hidden = !isMinute;
    find("problems").hidden = isMinute;
  }

  step(list, event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const tabs = [...list.children];
    const at = tabs.indexOf(document.activeElement);
    if (!step || at < 0) return;
    event.preventDefault();
    const next = tabs[(at + step + tabs.length) % tabs.length];
    next.focus();
    this.choose(next.dataset.pane);
  }
}

function mark(list, pane) {
  for (const tab of document.querySelectorAll(`${list} [role=tab]`)) {
    tab.setAttribute("aria-selected", String(tab.dataset.pane === pane));
  }
}
