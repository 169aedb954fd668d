// The screen of one robot: its newest picture, and the picture's age.

import { make } from "./dom.js";
import { pixelAt } from "./map_plan.js";

/** @import { Picture, Tap } from "./types.d.ts" */

const STALE_MS = 1000; // as in the console model: do not drive by it
const RATE_OVER_MS = 2000; // chosen: a rate a person can read

/**
 * Draws the newest picture only; `drawn` is called with the number of each picture that is on the screen, `tapped` with
 * the point of a fresh picture that was tapped, null for an old one; without it the picture takes no taps.
 */
export class Screen {
  /** @param {{ name: string, drawn: (number: number) => void, tapped?: (tap: Tap | null) => void }} given */
  constructor({ name, drawn, tapped }) {
    this.drawn = drawn;
    this.root = make("div", "screen");
    this.canvas = make("canvas");
    this.canvas.width = 320;
    this.canvas.height = 240;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `picture of ${name}`);
    if (tapped) this.canvas.addEventListener("click", (event) => this.tap(event, tapped));
    this.age = make("span", "age");
    this.root.append(this.canvas, this.age);
    this.drawnAt = 0;
    this.isStale = true;
    this.latencyMs = 0;
    /** @type {Picture | null} */
    this.pending = null;
    this.isBusy = false;
    this.count = this.rate = 0;
    this.since = performance.now();
  }

  /**
   * Receive a picture: the newest one replaces an older one that is not drawn yet.
   *
   * @param {Picture} picture
   */
  async saw(picture) {
    this.pending = picture;
    if (this.isBusy) return;
    this.isBusy = true;
    while (this.pending !== null) {
      const { number, jpeg } = this.pending;
      this.pending = null;
      const bitmap = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" })).catch(() => null);
      if (bitmap !== null) {
        await new Promise(requestAnimationFrame);
        this.draw(bitmap, number);
      }
      this.drawn(number);
    }
    this.isBusy = false;
  }

  /**
   * @param {ImageBitmap} bitmap
   * @param {number} number
   */
  draw(bitmap, number) {
    const { canvas } = this;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    canvas.getContext("2d")?.drawImage(bitmap, 0, 0);
    bitmap.close();
    canvas.dataset.number = String(number);
    this.drawnAt = performance.now();
    this.count += 1;
  }

  /**
   * @param {MouseEvent} event
   * @param {(tap: Tap | null) => void} tapped
   */
  tap(event, tapped) {
    const { width, height, clientWidth, clientHeight } = this.canvas;
    const pixel = pixelAt([event.offsetX, event.offsetY], [clientWidth, clientHeight], [width, height]);
    if (this.drawnAt === 0 || pixel === null) return;
    const [column_px, row_px] = pixel;
    tapped(this.isStale ? null : { column_px, row_px, width_px: width, height_px: height });
  }

  /**
   * Show the picture's age since capture; returns whether it is too old for driving.
   *
   * @param {number} now
   */
  look(now) {
    const span = now - this.since;
    if (span >= (this.rate === 0 ? 500 : RATE_OVER_MS)) {
      this.rate = (1000 * this.count) / span;
      this.count = 0;
      this.since = now;
    }
    const oldMs = now - this.drawnAt + this.latencyMs;
    const isStale = this.drawnAt === 0 || oldMs > STALE_MS;
    this.isStale = isStale;
    const latency = this.latencyMs ? ` · ${Math.round(this.latencyMs)} ms` : "";
    const fresh = `${this.rate.toFixed(0)}/s${latency}`;
    const text = this.drawnAt === 0 ? "no picture" : isStale ? `${(oldMs / 1000).toFixed(0)} s old` : fresh;
    if (this.age.textContent !== text) this.age.textContent = text;
    return isStale;
  }
}
