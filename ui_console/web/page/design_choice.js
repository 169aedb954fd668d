// The chosen element, and the action that waits until it is shown.

/** @import { DesignView, ElementView, Select } from "./design_messages.d.ts" */
/** @import { Path } from "./design_types.d.ts" */

/** Numbers this page's choices: an answer to an older choice is ignored. */
export class Choice {
  /** @param {{ view: Partial<DesignView>, say: (message: Select) => void }} given */
  constructor({ view, say }) {
    this.view = view;
    this.say = say;
    this.number = 0;
    /** @type {((element: ElementView) => void) | null} */
    this.waiting = null;
  }

  /** A new connection counts from the beginning. */
  begin() {
    this.number = 0;
  }

  /** @param {Path} path */
  choose(path) {
    this.number += 1;
    this.say({ do: "select", path, number: this.number });
  }

  /** The chosen element; undefined: a newer choice is on its way. */
  get element() {
    return this.view.selected === this.number ? this.view.element : undefined;
  }

  /**
   * Run an action as soon as the chosen element has arrived.
   *
   * @param {(element: ElementView) => void} act
   */
  whenShown(act) {
    if (this.element) act(this.element);
    else this.waiting = act;
  }

  /** @param {ElementView} element */
  shown(element) {
    const act = this.waiting;
    this.waiting = null;
    act?.(element);
  }
}
