// Controls: combines pad, keys and gamepad into one stick, which is sent repeatedly while it is held, and only then.

import { DRIVES } from "./keys.js";

/** @import { Say, Stick } from "./types.d.ts" */

const SAY_EVERY_MS = 50; // chosen: six times within the 300 ms after which the server stops the wheels
const SHOULDERS = [4, 5]; // Gamepad API, standard mapping
/** @type {Record<string, string>} */
const BUTTONS = { 0: "jump", 1: "stop_mine", 2: "stop_all", 3: "stop_all", 8: "release", 9: "take" }; // of gamepad.py
const DEAD_ZONE = 0.12; // chosen: worn sticks rest within this range

/**
 * Sends the stick's position while a control is held, and one stop after it.
 *
 * `does` is called with the action of a gamepad's button; `hint` is shown while a held control is ignored. A control
 * that is held when `letGo` is called is ignored until it is released and pressed again: a key, a finger, or the
 * gamepad's shoulder button.
 */
export class Driving {
  /**
   * @param {{ pad: HTMLElement, knob: HTMLElement, hint: HTMLElement, say: Say, isClogged: () => boolean,
   *   speed: () => number, moment: () => number, does: (what: string) => void }} given
   */
  constructor({ pad, knob, hint, say, isClogged, speed, moment, does }) {
    this.pad = pad;
    this.knob = knob;
    this.hint = hint;
    this.say = say;
    this.isClogged = isClogged;
    this.speed = speed;
    this.moment = moment;
    this.pressedAt = 0; // the moment at which the held control was pressed
    this.isOn = false;
    /** @type {Set<string>} */
    this.keys = new Set();
    /** @type {number | null} */
    this.pointer = null;
    this.box = pad.getBoundingClientRect(); // where the pad was when the pointer grabbed it
    /** @type {Stick} */
    this.stick = [0, 0];
    this.gamepad = new Gamepad(does);
    /** @type {ReturnType<typeof setInterval> | 0} */
    this.timer = 0;
    this.isFollowing = false;
    pad.addEventListener("pointerdown", (event) => this.grab(event));
    pad.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
      pad.addEventListener(end, (event) => this.drop(event));
    }
    addEventListener("keyup", (event) => {
      this.hint.hidden = true;
      if (this.keys.delete(event.code)) this.update();
    });
    addEventListener("pointerup", () => {
      this.hint.hidden = true;
    });
    addEventListener("keydown", (event) => {
      if (event.key === "Meta") this.loseKeys();
    });
    for (const taker of ["contextmenu", "dragstart"]) addEventListener(taker, () => this.loseKeys(), true);
    for (const opener of /** @type {const} */ (["pointerdown", "keydown"])) {
      addEventListener(opener, (event) => this.loseKeysTo(event), true);
    }
    addEventListener("blur", () => this.letGo());
    addEventListener("pagehide", () => this.letGo());
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) this.letGo();
    });
    addEventListener("gamepadconnected", () => this.followGamepad());
  }

  /**
   * Set whether there is a robot to drive; without one, controls are ignored.
   *
   * @param {boolean} isOn
   */
  turn(isOn) {
    if (isOn === this.isOn) return;
    this.letGo();
    this.isOn = isOn;
    this.pad.setAttribute("aria-disabled", String(!isOn));
  }

  /**
   * The present wish: [forward, right], or null if no control is held.
   *
   * @returns {Stick | null}
   */
  wanted() {
    if (!this.isOn) return null;
    if (this.pointer !== null) return this.stick;
    if (this.gamepad.stick !== null) return this.gamepad.stick;
    if (this.keys.size === 0) return null;
    let [forward, right] = [0, 0];
    for (const code of this.keys) {
      forward += DRIVES[code][0];
      right += DRIVES[code][1];
    }
    return [Math.sign(forward), Math.sign(right)];
  }

  /** @param {string} code */
  press(code) {
    this.keys.add(code);
    this.update();
  }

  /** @param {PointerEvent} event */
  grab(event) {
    if (!this.isOn || this.pointer !== null || (event.pointerType === "mouse" && event.button !== 0)) return;
    event.preventDefault();
    this.pad.focus({ preventScroll: true });
    this.pad.setPointerCapture(event.pointerId);
    this.pointer = event.pointerId;
    this.box = this.pad.getBoundingClientRect();
    this.drag(event);
  }

  /** @param {PointerEvent} event */
  drag(event) {
    if (event.pointerId !== this.pointer) return;
    if (event.pointerType === "mouse" && event.buttons !== 1) {
      this.drop(event); // browsers report the release of one mouse button only when all are up, and none to a menu
      return;
    }
    let right = (2 * (event.clientX - this.box.left)) / this.box.width - 1;
    let forward = 1 - (2 * (event.clientY - this.box.top)) / this.box.height;
    const length = Math.hypot(right, forward);
    if (length > 1) {
      right /= length;
      forward /= length;
    }
    this.stick = length < DEAD_ZONE ? [0, 0] : [forward, right];
    this.update();
  }

  /** @param {PointerEvent} event */
  drop(event) {
    if (event.pointerId !== this.pointer) return;
    this.pointer = null;
    this.stick = [0, 0];
    this.update();
  }

  /** Treat all controls as released; send a stop if one was held, or if a stop is required. */
  letGo(always = false) {
    const wasHeld = this.timer !== 0;
    if (wasHeld) this.hint.hidden = false;
    this.keys.clear();
    this.pointer = null;
    this.gamepad.spend();
    this.stick = [0, 0];
    if (wasHeld) this.update();
    else if (always) this.say({ do: "stop" });
  }

  /** Let go of held keys: browsers report no release during a menu or a drag, nor, on a Mac, while Command is held. */
  loseKeys() {
    if (this.keys.size > 0) this.letGo();
  }

  /**
   * Let go of held keys if the event may open a list of choices, because browsers report no release to an open list.
   *
   * @param {PointerEvent | KeyboardEvent} event
   */
  loseKeysTo(event) {
    if (event.target instanceof HTMLSelectElement && !("code" in event && event.code in DRIVES)) this.loseKeys();
  }

  followGamepad() {
    if (this.isFollowing) return;
    this.isFollowing = true;
    const look = () => {
      const found = [...navigator.getGamepads()].find((one) => one?.connected);
      this.gamepad.feel(document.hasFocus() ? (found ?? undefined) : undefined);
      if (this.timer !== 0 || this.gamepad.stick !== null) this.update();
      this.isFollowing = found !== undefined;
      if (found) requestAnimationFrame(look);
    };
    look();
  }

  update() {
    const wanted = this.wanted();
    this.pad.classList.toggle("is-held", wanted !== null);
    const [forward, right] = wanted ?? [0, 0];
    this.knob.style.transform = `translate(${right * 60}%, ${-forward * 60}%)`;
    if (wanted === null) {
      if (this.timer !== 0) {
        clearInterval(this.timer);
        this.timer = 0;
        this.say({ do: "stop" });
      }
    } else if (this.timer === 0) {
      this.hint.hidden = true;
      this.pressedAt = this.moment();
      this.timer = setInterval(() => this.send(), SAY_EVERY_MS);
      this.send();
    }
  }

  send() {
    const wanted = this.wanted();
    if (wanted === null || this.isClogged()) return; // a message that cannot be sent now must not arrive late
    const [forward, right] = wanted;
    this.say({ do: "drive", moment: this.pressedAt, forward, right, speed: this.speed() });
  }
}

/** The newest state of a gamepad. Pure: `feel` gets the browser's report. */
export class Gamepad {
  /** @param {(what: string) => void} does */
  constructor(does) {
    this.does = does;
    /** @type {Stick | null} */
    this.stick = null;
    this.isSpent = true; // a shoulder button held from the beginning was not pressed for this page
    /** @type {string[] | null} */
    this.pressed = null;
    this.index = 0;
  }

  /** Ignore held buttons. */
  spend() {
    this.stick = null;
    this.isSpent = true;
  }

  /**
   * Process its state; undefined: it is disconnected, or another window uses it.
   *
   * @param {{ index: number, buttons: readonly { pressed: boolean }[], axes: readonly number[] } | undefined} device
   */
  feel(device) {
    if (device === undefined || device.index !== this.index) {
      this.spend(); // nothing held on another gamepad was pressed for this page
      this.pressed = null;
    }
    if (device === undefined) return;
    this.index = device.index;
    const isDown = (/** @type {number} */ number) => device.buttons[number]?.pressed ?? false;
    const before = this.pressed;
    this.pressed = Object.keys(BUTTONS).filter((number) => isDown(Number(number)));
    if (before !== null) {
      for (const number of this.pressed) if (!before.includes(number)) this.does(BUTTONS[number]);
    }
    const isHeld = SHOULDERS.some(isDown);
    if (!isHeld) this.isSpent = false;
    this.stick = isHeld && !this.isSpent ? [near(-device.axes[1]), near(device.axes[0])] : null;
  }
}

/** @param {number} value */
function near(value) {
  return Math.abs(value) < DEAD_ZONE ? 0 : Math.max(-1, Math.min(1, value));
}
