// The present meaning of a key. Pure: a key and its place go in, an action comes out.

/** @type {Record<string, [number, number]>} */
export const DRIVES = {
  ArrowUp: [1, 0],
  KeyW: [1, 0],
  ArrowDown: [-1, 0],
  KeyS: [-1, 0],
  ArrowLeft: [0, -1],
  KeyA: [0, -1],
  ArrowRight: [0, 1],
  KeyD: [0, 1],
};
/** @type {Record<string, string>} */
const STOPS = { x: "stop_mine", X: "stop_all", " ": "halt", Escape: "halt" };
/** @type {Record<string, string>} */
const SPEEDS = { "+": "faster", "=": "faster", "-": "slower" };
const NO_TEXT = ["range", "checkbox", "radio", "button", "submit", "reset", "color", "file"];

/**
 * Returns {act, isTaken}, or null: the key is left to the browser. If `isTaken`, the browser must ignore it.
 *
 * Stops work with any focus, even in dialogs and fields, unless the page is cut off: then the fields of the login take
 * all letters. Drive keys do not work where arrows and letters are input, or
 * while a dialog is open.
 *
 * @typedef {{ key: string, code: string, isRepeat: boolean, hasModifier: boolean }} Key Of the event.
 * @typedef {{ isText: boolean, isRed: boolean, isDialog: boolean, isHeld: boolean, isCut?: boolean }} Place A text is
 *   written there; a red button has the focus; a dialog is open; a robot is held; the page is not connected.
 *
 * @param {Key} key
 * @param {Place} at
 */
export function meaningOf(key, at) {
  if (key.hasModifier || (at.isCut && at.isText)) return null;
  const stop = STOPS[key.key];
  if (stop) return { act: key.isRepeat ? "" : stop, isTaken: isStopTaken(key.key, at) };
  if (at.isText || at.isDialog || !at.isHeld) return null;
  if (key.code in DRIVES) return { act: key.isRepeat ? "" : "drive", isTaken: true };
  const speed = SPEEDS[key.key];
  return speed ? { act: speed, isTaken: true } : null;
}

/**
 * A stop letter is not written. A blank is written, and presses a focused button unless a robot is driven meanwhile.
 *
 * @param {string} key
 * @param {Place} at
 */
function isStopTaken(key, at) {
  if (key === "Escape") return false; // it closes dialogs, too
  if (key === " ") return at.isHeld && !at.isText && !at.isRed;
  return true;
}

/**
 * Returns whether typed keys are written there, or are the control's own: the arrows of a command's slider.
 *
 * @param {HTMLElement} element
 */
export function isText(element) {
  if (element.isContentEditable || element.tagName === "TEXTAREA" || element.dataset?.keys === "own") return true;
  return element.tagName === "INPUT" && !NO_TEXT.includes(/** @type {HTMLInputElement} */ (element).type);
}

/**
 * Takes every key of the page; `does` is called with an act and the key's code, `isHeld`: a robot is held, `isCut`: no
 * server hears.
 */
export class Keys {
  /** @param {{ does: (what: string, code: string) => void, isHeld: () => boolean, isCut: () => boolean }} given */
  constructor({ does, isHeld, isCut }) {
    let isSpaceTaken = false;
    addEventListener(
      "keyup",
      (event) => {
        if (event.key === " " && isSpaceTaken) event.preventDefault();
      },
      true,
    );
    addEventListener(
      "keydown",
      (event) => {
        const target = /** @type {HTMLElement} */ (event.target);
        const hasAlt = event.altKey && !(event.key in STOPS); // Alt leaves the stops, as in terminals
        const hasModifier = event.ctrlKey || event.metaKey || hasAlt;
        if (event.altKey && isText(target) && event.code === "KeyX") {
          write(event);
          return;
        }
        const meaning = meaningOf(
          { key: event.key, code: event.code, isRepeat: event.repeat, hasModifier },
          {
            isText: isText(target),
            isRed: Boolean(target.closest?.(".emergency")),
            isDialog: document.querySelector("dialog[open]") !== null,
            isHeld: isHeld(),
            isCut: isCut(),
          },
        );
        if (event.key === " ") isSpaceTaken = meaning?.isTaken ?? false; // a button is pressed when it comes up again
        if (meaning === null) return;
        if (meaning.isTaken) event.preventDefault();
        if (meaning.act) does(meaning.act, event.code);
      },
      true,
    );
  }
}

/**
 * Write the letter that otherwise stops robots.
 *
 * @param {KeyboardEvent} event
 */
function write(event) {
  event.preventDefault();
  const field = /** @type {HTMLInputElement} */ (event.target);
  const letter = event.shiftKey ? "X" : "x";
  field.setRangeText(
    letter,
    field.selectionStart ?? field.value.length,
    field.selectionEnd ?? field.value.length,
    "end",
  );
  field.dispatchEvent(new Event("input", { bubbles: true }));
}
