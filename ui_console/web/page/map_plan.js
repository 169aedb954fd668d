// Conversion between places on the floor and points of the screen. Pure.

import { readingOrder } from "./text.js";

/** @import { BodyView, FloorView } from "./messages.d.ts" */
/** @import { Point } from "./types.d.ts" */

export const REACH_PX = 22; // half of 44 px, the size of a touch target
const LEAST_M = 0.5; // chosen: a floor is never drawn as smaller than that

/** The floor on the screen: x to the right, y upwards, a pixel everywhere as large. */
export class Plan {
  /**
   * As large as fits.
   *
   * @param {Pick<FloorView, "width_m" | "depth_m">} floor
   * @param {number} widthPx
   * @param {number} heightPx
   */
  constructor(floor, widthPx, heightPx) {
    this.width_m = Math.max(LEAST_M, floor.width_m);
    this.depth_m = Math.max(LEAST_M, floor.depth_m);
    this.pxPerM = Math.max(1, Math.min(widthPx / this.width_m, heightPx / this.depth_m));
    this.widthPx = this.pxPerM * this.width_m;
    this.heightPx = this.pxPerM * this.depth_m;
  }

  /**
   * @param {number} x_m
   * @param {number} y_m
   * @returns {Point}
   */
  at(x_m, y_m) {
    return [this.pxPerM * x_m, this.heightPx - this.pxPerM * y_m];
  }

  /**
   * The place on the floor at a point, in whole centimeters; for a point beside the floor, the nearest place on its
   *     edge.
   *
   * @param {Point} point
   * @returns {Point}
   */
  place([left, top]) {
    const x_m = Math.max(0, Math.min(this.width_m, left / this.pxPerM));
    const y_m = Math.max(0, Math.min(this.depth_m, (this.heightPx - top) / this.pxPerM));
    return [Math.round(100 * x_m) / 100, Math.round(100 * y_m) / 100];
  }

  /**
   * The robot that a touch at this point selects; null: the touch is on the floor.
   *
   * @param {Point} point
   * @param {BodyView[]} bodies
   * @returns {BodyView | null}
   */
  robotAt(point, bodies) {
    const near = bodies
      .filter((body) => body.is_robot)
      .map((body) => ({ body, px: distance(this.at(body.x_m, body.y_m), point) }))
      .filter(({ px }) => px <= REACH_PX)
      .sort((one, other) => one.px - other.px);
    return near.length ? near[0].body : null;
  }

  /**
   * The points of a trail, for `points` of a line.
   *
   * @param {number[]} trail x and y in turn.
   */
  line(trail) {
    const points = [];
    for (let one = 0; one + 1 < trail.length; one += 2) points.push(this.at(trail[one], trail[one + 1]));
    return points.map(([left, top]) => `${left.toFixed(1)},${top.toFixed(1)}`).join(" ");
  }
}

/**
 * @param {Point} one
 * @param {Point} other
 */
function distance([left, top], [otherLeft, otherTop]) {
  return Math.hypot(left - otherLeft, top - otherTop);
}

/** @type {Record<string, Point>} */
const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * The cross's place after a key; null: the key does not move it.
 *
 * @param {Point} from
 * @param {string} key
 * @param {number} step_m
 * @param {Pick<FloorView, "width_m" | "depth_m">} floor
 * @returns {Point | null}
 */
export function stepped([x_m, y_m], key, step_m, floor) {
  const step = STEPS[key];
  if (step === undefined) return null;
  const within = (/** @type {number} */ value, /** @type {number} */ most) =>
    Math.round(100 * Math.max(0, Math.min(most, value))) / 100;
  return [within(x_m + step_m * step[0], floor.width_m), within(y_m + step_m * step[1], floor.depth_m)];
}

/**
 * The point of a picture that is drawn as large as fits into a box, by a point of the box; null: beside the picture.
 *
 * @param {Point} point
 * @param {Point} box Width and height.
 * @param {Point} size Of the picture.
 * @returns {Point | null}
 */
export function pixelAt([left, top], [boxWidth, boxHeight], [width, height]) {
  const scale = Math.min(boxWidth / width, boxHeight / height);
  const column = (left - (boxWidth - scale * width) / 2) / scale - 0.5;
  const row = (top - (boxHeight - scale * height) / 2) / scale - 0.5;
  const isInside = column >= -0.5 && row >= -0.5 && column <= width - 0.5 && row <= height - 0.5;
  return isInside ? [column, row] : null;
}

/**
 * The robots that an order concerns: the selected ones, or else the held one.
 *
 * @param {Iterable<string>} selected
 * @param {string} inHand Empty: none.
 */
export function meantBy(selected, inHand) {
  const all = [...selected].sort(readingOrder);
  return all.length || !inHand ? all : [inHand];
}

/**
 * Names for people: "scout1", "scout1 and scout2", "scout1, scout2 and scout3".
 *
 * @param {string[]} names
 */
export function listed(names) {
  return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`;
}
