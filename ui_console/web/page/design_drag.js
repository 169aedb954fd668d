// Dragging by mouse, pen or finger: one path for all of them, for a finger drags nothing by the browser's own means.

const BEGINS_AFTER_PX = 6; // chosen: a click that shakes is still a click
const EDGE_PX = 48; // chosen: about a finger; nearer to the edge than this the tree scrolls
const SCROLL_PX = 10; // a frame
const BORDER_SHARE = 0.28; // chosen: of a row's height, above and below, where the place between rows is meant

/**
 * Whatever has `data-drag` can be dragged: by a mouse anywhere, by a finger at its `.handle`, so that fingers still scroll.
 *
 * `place(what, row, part)` says what a drop there would mean, or null; part is "before", "into" or "after".
 * `drop(place)` does it.
 */
export class Drag {
  constructor({ tree, what, place, drop }) {
    Object.assign(this, { tree, what, place, drop });
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

  down(event) {
    if (this.held || !event.isPrimary || (event.pointerType === "mouse" && event.button !== 0)) return;
    const source = event.target.closest("[data-drag]");
    if (!source || event.target.closest("button, input, select")) return;
    if (event.pointerType !== "mouse" && !event.target.closest(".handle")) return;
    if (event.target.hasPointerCapture?.(event.pointerId)) event.target.releasePointerCapture(event.pointerId);
    this.held = {
      pointer: event.pointerId,
      x: event.clientX,
      y: event.clientY,
      source,
      what: this.what(source),
      ghost: null,
      place: null,
    };
  }

  move(event) {
    const held = this.held;
    if (!held || event.pointerId !== held.pointer) return;
    if (!held.ghost) {
      if (Math.hypot(event.clientX - held.x, event.clientY - held.y) < BEGINS_AFTER_PX) return;
      this.begin();
    }
    [held.x, held.y] = [event.clientX, event.clientY];
    held.ghost.style.transform = `translate(${held.x + 12}px, ${held.y + 12}px)`;
    this.look();
  }

  begin() {
    const held = this.held;
    held.ghost = document.createElement("div");
    held.ghost.className = "ghost";
    held.ghost.textContent = held.what.told;
    document.body.append(held.ghost);
    document.body.classList.add("is-dragging");
    held.source.classList.add("is-dragged");
    const scroll = () => {
      if (this.held !== held) return;
      const box = this.tree.getBoundingClientRect();
      if (held.x > box.left && held.x < box.right) {
        if (held.y < box.top + EDGE_PX) this.tree.scrollTop -= SCROLL_PX;
        else if (held.y > box.bottom - EDGE_PX) this.tree.scrollTop += SCROLL_PX;
      }
      this.look();
      requestAnimationFrame(scroll);
    };
    requestAnimationFrame(scroll);
  }

  /** Show where it would go now. */
  look() {
    const held = this.held;
    const row = document.elementFromPoint(held.x, held.y)?.closest("#tree .element") ?? null;
    let place = null;
    if (row) {
      const box = row.getBoundingClientRect();
      const share = (held.y - box.top) / box.height;
      const part = share < BORDER_SHARE ? "before" : share > 1 - BORDER_SHARE ? "after" : "into";
      place = this.place(held.what, row, part) ?? (part === "into" ? null : this.place(held.what, row, "into"));
    }
    this.unmark();
    held.place = place;
    held.ghost.classList.toggle("is-refused", place === null);
    place?.row.classList.add(`drop-${place.part}`);
  }

  up(event) {
    const held = this.held;
    if (!held || event.pointerId !== held.pointer) return;
    const place = held.ghost ? held.place : null;
    if (held.ghost) addEventListener("click", stopClick, { capture: true, once: true });
    setTimeout(() => removeEventListener("click", stopClick, { capture: true }));
    this.end();
    if (place) this.drop(place);
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

function stopClick(event) {
  event.stopPropagation();
  event.preventDefault();
}
