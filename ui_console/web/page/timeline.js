// Past, present and predicted holders of each resource; drawn in the shown size, so that its text is readable.

import { drawn } from "./svg.js";
import { seconds, shortened } from "./text.js";

/** @import { SliceView, TimelineRow, TimelineView } from "./messages.d.ts" */

const ROW_PX = 28,
  LEFT_PX = 110,
  LEAST_PX = 560,
  LETTER_PX = 7.2,
  FOOT_PX = 20;

/**
 * Returns the picture of a timeline with this width in pixels; wider if that is too narrow to be readable.
 *
 * @param {TimelineView} view
 * @param {number} widthPx
 */
export function timeline(view, widthPx) {
  const width = Math.max(LEAST_PX, widthPx) - LEFT_PX,
    height = ROW_PX * view.rows.length;
  const svg = drawn("svg", {
    class: "timeline",
    width: LEFT_PX + width,
    height: height + FOOT_PX,
    role: "img",
    "aria-label": "who had which resource, who has it, who comes next",
  });
  const within = (/** @type {number} */ time) => Math.max(view.from_s, Math.min(view.to_s, time));
  const at = (/** @type {number} */ time) =>
    LEFT_PX + (width * (within(time) - view.from_s)) / (view.to_s - view.from_s);
  for (const [number, row] of view.rows.entries()) svg.append(...rowOf(row, number * ROW_PX, at));
  const here = at(view.now_s);
  svg.append(drawn("line", { x1: here, x2: here, y1: 0, y2: height, class: "here" }));
  svg.append(drawn("text", { x: here - 30, y: height + 15 }, seconds(view.now_s)));
  return svg;
}

/**
 * @param {TimelineRow} row
 * @param {number} top
 * @param {(time: number) => number} at
 */
function rowOf(row, top, at) {
  const name = drawn("text", { x: 4, y: top + 18 }, shortened(row.rc, Math.floor(LEFT_PX / LETTER_PX) - 1));
  name.append(drawn("title", {}, row.rc));
  return [name, ...row.slices.flatMap((slice) => sliceOf(slice, top, at))];
}

/**
 * @param {SliceView} slice
 * @param {number} top
 * @param {(time: number) => number} at
 */
function sliceOf(slice, top, at) {
  const from = at(slice.from_s),
    width = Math.max(1, at(slice.to_s) - from);
  const kind = `${slice.certainty}${slice.is_console ? " console" : ""}`;
  const bar = drawn("rect", { x: from, y: top + 3, width, height: ROW_PX - 6, rx: 3, class: kind });
  bar.append(drawn("title", {}, `${slice.who}: ${seconds(slice.from_s)} to ${seconds(slice.to_s)}`));
  const label = shortened(slice.who, Math.floor((width - 8) / LETTER_PX));
  return label ? [bar, drawn("text", { x: from + 4, y: top + 18 }, label)] : [bar];
}
