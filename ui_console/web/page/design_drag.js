// Dragging by mouse, pen or finger: one implementation for all, because browsers have no dragging by finger.

import { around, make } from "./dom.js";

/** @import { Dragged, DropPlace, RowPart } from "./design_types.d.ts" */

const BEGINS_AFTER_PX = 6; // chosen: a shaky click is still a click
const EDGE_PX = 48; // chosen: about a finger; nearer to the edge than this the tree scrolls
const SCROLL_PX = 10; // a frame
const BORDER_SHARE = 0.28; // chosen: share of a row's height, above and below, that means the place between rows

/**
 * The element held by a pointer; dragging has begun once it has a ghost.
 *
 * @typedef {{ pointer: number, x: number, y: number, source: HTMLElement, what: Dragged, ghost: HTMLElement | null,
 *   place: DropPlace | null }} Held
 */

/**
 * Elements with `data-drag` can be dragged: by a mouse anywhere, by a finger at their `.handle`, so that fingers still
 * scroll.
 *
 * `what(source)` returns the dragged element, or null; `place(what, row, part)` the meaning of a drop there, or null.
 */
export class Drag {
  /**
   * @param {{ tree: HTMLElement, what: (source: HTMLElement) => Dragged | null,
   *   place: (what: Dragged, row: HTMLElement, part: RowPart) => DropPlace | null }} given
   */
  constructor({ tree, what, place }) {
    this.tree = tree;
    this.what = what;
    this.place = place;
    /** @type {Held | null} */
    this.held = null;
    document.addEventListener("pointerdown", (event) => this.down(event));
    document.addEventListener("pointermove", (event) => this.move(event));
    document.addEventListener("pointerup", (event) => this.up(event));
    document.addEventListener("pointercancel", () => this.end());
    document.addEventListener(
      "keydown",
      (event) => {
        if (event.key === "Escape" && this.held) {
          event.stopPropagation();
          this.end();
        }
      },
      true,
    );
    addEventListener("blur", () => this.end());
  }

  /** @param {PointerEvent} event */
  down(event) {
    removeEventListener("click", stopClick, { capture: true }); // the click of this press is none of the last drag
    if (this.held || !event.isPrimary || (event.pointerType === "mouse" && event.button !== 0)) return;
    const source = around(event, "[data-drag]");
    if (!source || around(event, "button, input, select")) return;
    if (event.pointerType !== "mouse" && !around(event, ".handle")) return;
    const { pointerId: pointer, clientX: x, clientY: y, target } = event;
    const what = this.what(source);
    if (!what) return;
    if (target instanceof Element && target.hasPointerCapture(pointer)) target.releasePointerCapture(pointer);
    this.held = { pointer, x, y, source, what, ghost: null, place: null };
  }

  /** @param {PointerEvent} event */
  move(event) {
    const held = this.held;
    if (!held || event.pointerId !== held.pointer) return;
    const isShaking = Math.hypot(event.clientX - held.x, event.clientY - held.y) < BEGINS_AFTER_PX;
    if (!held.ghost && isShaking) return;
    [held.x, held.y] = [event.clientX, event.clientY];
    held.ghost ??= this.begin(held);
    held.ghost.style.transform = `translate(${held.x + 12}px, ${held.y + 12}px)`;
    this.look(held, held.ghost);
  }

  /** @param {Held} held */
  begin(held) {
    const ghost = make("div", "ghost", held.what.told);
    document.body.append(ghost);
    document.body.classList.add("is-dragging");
    held.source.classList.add("is-dragged");
    const scroll = () => {
      if (this.held !== held) return;
      const box = this.tree.getBoundingClientRect();
      if (held.x > box.left && held.x < box.right) {
        if (held.y < box.top + EDGE_PX) this.tree.scrollTop -= SCROLL_PX;
        else if (held.y > box.bottom - EDGE_PX) this.tree.scrollTop += SCROLL_PX;
      }
      this.look(held, ghost);
      requestAnimationFrame(scroll);
    };
    requestAnimationFrame(scroll);
    return ghost;
  }

  /**
   * Show the place that the element would get if dropped now.
   *
   * @param {Held} held
   * @param {HTMLElement} ghost
   */
  look(held, ghost) {
    const row = document.elementFromPoint(held.x, held.y)?.closest("#tree .element");
    held.place = row instanceof HTMLElement ? this.placeAt(held, row) : null;
    this.unmark();
    ghost.classList.toggle("is-refused", held.place === null);
    held.place?.row.classList.add(`drop-${held.place.part}`);
  }

  /**
   * @param {Held} held
   * @param {HTMLElement} row
   */
  placeAt({ y, what }, row) {
    const box = row.getBoundingClientRect();
    const share = (y - box.top) / box.height;
    const part = share < BORDER_SHARE ? "before" : share > 1 - BORDER_SHARE ? "after" : "into";
    return this.place(what, row, part) ?? (part === "into" ? null : this.place(what, row, "into"));
  }

  /** @param {PointerEvent} event */
  up(event) {
    const held = this.held;
    if (!held || event.pointerId !== held.pointer) return;
    const place = held.ghost ? held.place : null;
    if (held.ghost) addEventListener("click", stopClick, { capture: true, once: true });
    setTimeout(() => removeEventListener("click", stopClick, { capture: true }));
    this.end();
    place?.do();
  }

  end() {
    if (!this.held) return;
    this.held.ghost?.remove();
    this.held.source.classList.remove("is-dragged");
    this.held = null;
    document.body.classList.remove("is-dragging");
    this.unmark();
  }

  unmark() {
    for (const part of ["before", "into", "after"])
      this.tree.querySelector(`.drop-${part}`)?.classList.remove(`drop-${part}`);
  }
}

/** @param {Event} event */
function stopClick(event) {
  event.stopPropagation();
  event.preventDefault();
}
