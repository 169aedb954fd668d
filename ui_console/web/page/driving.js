// Hands: pad, keys and gamepad become one stick, which is told again and again while it is held, and never otherwise.

const SAY_EVERY_MS = 50; // chosen: six times within the 300 ms after which the server stops the wheels
const KEYS = {
  ArrowUp: [1, 0], KeyW: [1, 0], ArrowDown: [-1, 0], KeyS: [-1, 0],
  ArrowLeft: [0, -1], KeyA: [0, -1], ArrowRight: [0, 1], KeyD: [0, 1],
};
const SHOULDERS = [4, 5]; // Gamepad API, standard mapping
const FACE_STOP = 1;
const DEAD_ZONE = 0.12; // chosen: worn sticks rest within it

/** Says where the stick is while something holds it, and one stop when nothing does any more. */
export class Driving {
  constructor({ pad, knob, say, isClogged, speed }) {
    Object.assign(this, { pad, knob, say, isClogged, speed });
    this.keys = new Set();
    this.pointer = null;
    this.stick = [0, 0];
    this.gamepad = null;
    this.hadGamepadHold = false;
    this.timer = 0;
    pad.addEventListener("pointerdown", (event) => this.grab(event));
    pad.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) pad.addEventListener(end, (event) => this.drop(event));
    addEventListener("keydown", (event) => this.keyDown(event));
    addEventListener("keyup", (event) => { this.keys.delete(event.code); this.update(); });
    addEventListener("blur", () => this.letGo());
    addEventListener("pagehide", () => this.letGo());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.letGo(); });
    addEventListener("gamepadconnected", () => this.lookAtGamepads());
  }

  /** What is wanted now: [forward, right], or null if nothing is held. */
  wanted() {
    if (this.pointer !== null) return this.stick;
    if (this.gamepad !== null) return this.gamepad;
    if (this.keys.size === 0) return null;
    let [forward, right] = [0, 0];
    for (const code of this.keys) { forward += KEYS[code][0]; right += KEYS[code][1]; }
    return [Math.sign(forward), Math.sign(right)];
  }

  grab(event) {
    if (this.pointer !== null || (event.pointerType === "mouse" && event.button !== 0)) return;
    event.preventDefault();
    this.pad.focus({ preventScroll: true });
    this.pad.setPointerCapture(event.pointerId);
    this.pointer = event.pointerId;
    this.drag(event);
  }

  drag(event) {
    if (event.pointerId !== this.pointer) return;
    const box = this.pad.getBoundingClientRect();
    let right = (2 * (event.clientX - box.left)) / box.width - 1;
    let forward = 1 - (2 * (event.clientY - box.top)) / box.height;
    const length = Math.hypot(right, forward);
    if (length > 1) { right /= length; forward /= length; }
    this.stick = length < DEAD_ZONE ? [0, 0] : [forward, right];
    this.update();
  }

  drop(event) {
    if (event.pointerId !== this.pointer) return;
    this.pointer = null;
    this.stick = [0, 0];
    this.update();
  }

  keyDown(event) {
    if (event.target.closest("input, textarea, select, dialog") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.code === "Space" || event.code === "Escape") {
      if (!event.target.closest("button")) event.preventDefault();
      this.letGo(true);
    } else if (event.code in KEYS && !(event.target.closest("[role=tablist]") && event.code.startsWith("Arrow"))) {
      event.preventDefault();
      if (event.repeat) return; // a key that was let go by a stop counts again only when it is pressed again
      this.keys.add(event.code);
      this.update();
    }
  }

  /** Nothing is held any more, whatever the hands do; a stop is said if something was, or if it has to be. */
  letGo(always = false) {
    const held = this.timer !== 0;
    this.keys.clear();
    this.pointer = null;
    this.gamepad = null;
    this.stick = [0, 0];
    if (held) this.update(); else if (always) this.say({ do: "stop" });
  }

  lookAtGamepads() {
    const found = [...navigator.getGamepads()].find((one) => one !== null && one.connected);
    if (!found) { this.gamepad = null; this.update(); return; }
    const isHeld = SHOULDERS.some((button) => found.buttons[button]?.pressed) && !found.buttons[FACE_STOP]?.pressed;
    const near = (value) => (Math.abs(value) < DEAD_ZONE ? 0 : Math.max(-1, Math.min(1, value)));
    this.gamepad = isHeld && document.hasFocus() ? [near(-found.axes[1]), near(found.axes[0])] : null;
    if (this.gamepad !== null || this.hadGamepadHold) this.update();
    this.hadGamepadHold = this.gamepad !== null;
    requestAnimationFrame(() => this.lookAtGamepads());
  }

  update() {
    const wanted = this.wanted();
    this.pad.classList.toggle("is-held", wanted !== null);
    const [forward, right] = wanted ?? [0, 0];
    this.knob.style.transform = `translate(${right * 60}%, ${-forward * 60}%)`;
    if (wanted === null) {
      if (this.timer !== 0) { clearInterval(this.timer); this.timer = 0; this.say({ do: "stop" }); }
    } else if (this.timer === 0) {
      this.timer = setInterval(() => this.tell(), SAY_EVERY_MS);
      this.tell();
    }
  }

  tell() {
    const wanted = this.wanted();
    if (wanted === null || this.isClogged()) return; // what cannot leave now must not arrive late
    this.say({ do: "drive", forward: wanted[0], right: wanted[1], speed_rad_s: this.speed() });
  }
}
