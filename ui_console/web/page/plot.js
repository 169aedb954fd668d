// Plot of a number over the last minute, as a line.

import { drawn } from "./svg.js";
import { shortened } from "./text.js";

const SPAN_S = 60; // chosen: as the timeline of the resources
const LEAST_SPAN_S = 5; // chosen: so that the first points do not move fast across the plot
const MOST_POINTS = 600; // chosen: ten in each second of the span, as many as the server sends
const [WIDTH, HEIGHT, EDGE] = [400, 100, 18];

/**
 * Append a point and remove points older than the span. If time goes back, in a recording, begin again.
 *
 * @param {[number, number][]} points Time and value, in the order of time.
 * @param {[number, number]} next
 */
export function extend(points, next) {
  if (points.length > 0 && next[0] < points[points.length - 1][0]) points.length = 0;
  points.push(next);
  while (points.length > MOST_POINTS || points[0][0] < next[0] - SPAN_S) points.shift();
}

/**
 * Where the line goes, the least and most of its values, and the time from left to right, which grows up to the span; a
 * line of one value lies in the middle. Pure.
 *
 * @param {[number, number][]} points At least one.
 */
export function lineOf(points) {
  const values = points.map(([, value]) => value);
  const [least, most] = [Math.min(...values), Math.max(...values)];
  const [first_s, last_s] = [points[0][0], points[points.length - 1][0]];
  const span_s = Math.max(LEAST_SPAN_S, last_s - first_s);
  const room = HEIGHT - 2 * EDGE;
  const line = points.map(([at_s, value]) => {
    const x = WIDTH * (1 + (at_s - last_s) / span_s);
    const y = most > least ? EDGE + room * ((most - value) / (most - least)) : HEIGHT / 2;
    return `${x.toFixed(1)},${y.toFixed(1)}`;
  });
  return { line: line.join(" "), least, most, span_s };
}

/**
 * A number in short form for people. Pure.
 *
 * @param {number} value
 */
export function short(value) {
  return String(Number(value.toPrecision(4)));
}

/** The plot of one field. */
export class Plot {
  /** @param {string} name */
  constructor(name) {
    this.name = name;
    this.root = drawn("svg", { class: "plot", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img" });
    this.line = drawn("polyline", { class: "line", points: "" });
    this.most = drawn("text", { x: 4, y: 13 });
    this.least = drawn("text", { x: 4, y: HEIGHT - 5 });
    this.now = drawn("text", { x: WIDTH - 4, y: 13, "text-anchor": "end" });
    this.span = drawn("text", { x: WIDTH - 4, y: HEIGHT - 5, "text-anchor": "end" });
    this.root.append(this.line, this.most, this.least, this.now, this.span);
  }

  /** @param {[number, number][]} points At least one. */
  draw(points) {
    const { line, least, most, span_s } = lineOf(points);
    const now = short(points[points.length - 1][1]);
    this.line.setAttribute("points", line);
    this.most.textContent = short(most);
    this.least.textContent = short(least);
    this.now.textContent = `${shortened(this.name, 30)} ${now}`;
    this.span.textContent = `${span_s.toFixed(0)} s`;
    this.root.setAttribute(
      "aria-label",
      `${this.name}: now ${now}, from ${short(least)} to ${short(most)} in the last ${span_s.toFixed(0)} s`,
    );
  }
}
