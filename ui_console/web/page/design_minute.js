// The first minute of the schedule, as a chart and in words.

import { make } from "./dom.js";
import { drawn } from "./svg.js";

/** @import { RehearsalRow, RehearsalView, TurnView } from "./design_messages.d.ts" */

const COLORS = 6;
const ROW_PX = 24,
  LEFT_PX = 170,
  WIDTH_PX = 830;

/**
 * @param {HTMLElement} root
 * @param {RehearsalView | null | undefined} minute undefined: it is not known yet; null: there is none.
 */
export function showMinute(root, minute) {
  if (minute?.rows.length) {
    const lines = make("ul");
    lines.append(...minute.never.map((one) => make("li", "failure", one)));
    lines.append(...minute.told.map((one) => make("li", "", one)));
    root.replaceChildren(chart(minute), lines);
  } else root.replaceChildren(make("p", "", nothing(minute)));
}

/** @param {RehearsalView | null | undefined} minute */
function nothing(minute) {
  if (minute === undefined) return "…";
  return minute ? "Nobody asks for anything." : "It has problems; a dry run needs a mission that check says is fine.";
}

/** @param {RehearsalView} minute */
function chart(minute) {
  const height = ROW_PX * minute.rows.length;
  const arcs = minute.rows.filter((row) => row.is_arc).map((row) => row.name);
  const color = (/** @type {string} */ arc) => `color-${Math.max(0, arcs.indexOf(arc)) % COLORS}`;
  const at = (/** @type {number} */ time) => LEFT_PX + (WIDTH_PX * time) / minute.end_s;
  const svg = drawn("svg", {
    class: "minute",
    viewBox: `0 0 ${LEFT_PX + WIDTH_PX} ${height + 20}`,
    role: "img",
    "aria-label": `who runs when in the first ${minute.end_s} s`,
  });
  for (const [number, row] of minute.rows.entries()) svg.append(...rowOf(row, number * ROW_PX, at, color));
  for (let time = 0; time <= minute.end_s; time += 10)
    svg.append(drawn("text", { x: at(time) - (time ? 16 : 0), y: height + 15 }, `${time} s`));
  return svg;
}

/**
 * @param {RehearsalRow} row
 * @param {number} top
 * @param {(time: number) => number} at
 * @param {(arc: string) => string} color
 */
function rowOf(row, top, at, color) {
  const name = drawn("text", { x: 4, y: top + 16 }, row.name.slice(0, 24));
  return [name, ...row.turns.flatMap((turn) => turnOf(turn, top, at, color(row.is_arc ? row.name : turn.who)))];
}

/**
 * @param {TurnView} turn
 * @param {number} top
 * @param {(time: number) => number} at
 * @param {string} color
 */
function turnOf(turn, top, at, color) {
  const open = at(turn.open_s),
    from = at(turn.from_s);
  const bar = drawn("rect", {
    x: open,
    y: top + 3,
    width: Math.max(0.5, at(turn.to_s) - open),
    height: ROW_PX - 6,
    rx: 2,
    class: color,
  });
  bar.append(drawn("title", {}, `${turn.who}: ${turn.open_s.toFixed(1)} s to ${turn.to_s.toFixed(1)} s`));
  const settling = { x: from, y: top + 8, width: Math.max(0, open - from), height: ROW_PX - 16, class: "settles" };
  return [drawn("rect", settling), bar];
}
