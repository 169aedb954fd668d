// The drawing of the map: plan, robots with heading, spread, trail and view, places they are sent to, the cross.

import { REACH_PX } from "./map_plan.js";
import { drawn } from "./svg.js";

/** @import { BodyView, FloorView, OrderView } from "./messages.d.ts" */
/** @import { Plan } from "./map_plan.js" */
/** @import { Point } from "./types.d.ts" */

const BODY_PX = 9; // half the length of a robot's arrow, visible at any scale, whatever the robot's size
const SIGHT_M = 1.5; // chosen: length of the wedge that shows a robot's field of view
const GRID_M = 1;
const DEGREES = 180 / Math.PI;

/**
 * The parts of the floor that do not move.
 *
 * @param {FloorView} floor
 * @param {Plan} plan
 */
export function drawFloor(floor, plan) {
  const { widthPx, heightPx } = plan;
  const parts = [drawn("rect", { class: "floor", x: 0, y: 0, width: widthPx, height: heightPx })];
  for (let x_m = GRID_M; x_m < plan.width_m; x_m += GRID_M) {
    const [left] = plan.at(x_m, 0);
    parts.push(drawn("line", { class: "grid", x1: left, x2: left, y1: 0, y2: heightPx }));
  }
  for (let y_m = GRID_M; y_m < plan.depth_m; y_m += GRID_M) {
    const [, top] = plan.at(0, y_m);
    parts.push(drawn("line", { class: "grid", x1: 0, x2: widthPx, y1: top, y2: top }));
  }
  for (const shape of floor.shapes) {
    const [left, top] = plan.at(shape.x_m, shape.y_m);
    const [width, height] = [plan.pxPerM * shape.width_m, plan.pxPerM * shape.depth_m];
    const turn = `translate(${left} ${top}) rotate(${-DEGREES * shape.heading_rad})`;
    const box = drawn("rect", { class: shape.kind, x: -width / 2, y: -height / 2, width, height, transform: turn });
    box.append(drawn("title", {}, `${shape.kind} ${shape.name}`));
    parts.push(box);
  }
  return parts;
}

/**
 * @param {BodyView} body
 * @param {Plan} plan
 * @param {{ isMine: boolean, isSelected: boolean }} as
 */
export function drawBody(body, plan, { isMine, isSelected }) {
  const [left, top] = plan.at(body.x_m, body.y_m);
  const words = ["body", body.is_robot ? "robot-mark" : "other-mark"];
  if (isMine) words.push("is-mine");
  if (isSelected) words.push("is-selected");
  if (body.is_stale) words.push("is-stale");
  const group = drawn("g", { class: words.join(" "), "data-body": body.name });
  group.append(drawn("polyline", { class: "trail", points: plan.line(body.trail) }));
  const here = drawn("g", { transform: `translate(${left} ${top})` });
  const heading = drawn("g", { transform: `rotate(${-DEGREES * body.heading_rad})` });
  if (body.sees_rad > 0) heading.append(drawn("path", { class: "sight", d: wedge(body.sees_rad, plan.pxPerM) }));
  if (body.spread_m > 0) here.append(drawn("circle", { class: "spread", r: body.spread_m * plan.pxPerM }));
  if (isSelected) here.append(drawn("circle", { class: "ring", r: REACH_PX }));
  heading.append(drawn("path", { class: "arrow", d: body.is_robot ? arrow() : disc() }));
  here.append(heading);
  const isRight = left < plan.widthPx - 130;
  const place = { x: isRight ? REACH_PX - 8 : 8 - REACH_PX, "text-anchor": isRight ? "start" : "end" };
  here.append(drawn("text", { class: "name", y: -6, ...place }, body.name));
  here.append(drawn("text", { class: "source", y: 10, ...place }, age(body) || body.source));
  group.append(here);
  return group;
}

/**
 * How old its place is, for people; empty: it is new.
 *
 * @param {BodyView} body
 */
export function age(body) {
  return body.is_stale ? `${body.age_s.toFixed(0)} s old` : "";
}

/**
 * The goal of a robot, and the straight line to it.
 *
 * @param {OrderView} order
 * @param {BodyView | undefined} body
 * @param {Plan} plan
 */
export function drawGoal(order, body, plan) {
  const [left, top] = plan.at(order.x_m, order.y_m);
  const parts = [drawn("path", { class: "goal", d: `M${left} ${top}v-18l12 5l-12 5`, "data-goal": order.robot })];
  if (body) {
    const [x1, y1] = plan.at(body.x_m, body.y_m);
    parts.push(drawn("line", { class: "way", x1, y1, x2: left, y2: top }));
  }
  return parts;
}

/** @param {Point} place */
export function drawCross([left, top]) {
  const d = `M${left - 14} ${top}h28M${left} ${top - 14}v28`;
  return [drawn("path", { class: "cross-ground", d }), drawn("path", { class: "cross-mark", d })];
}

function arrow() {
  return `M${1.3 * BODY_PX} 0L${-BODY_PX} ${0.85 * BODY_PX}L${-0.5 * BODY_PX} 0L${-BODY_PX} ${-0.85 * BODY_PX}Z`;
}

function disc() {
  return `M${BODY_PX} 0A${BODY_PX} ${BODY_PX} 0 1 1 ${-BODY_PX} 0A${BODY_PX} ${BODY_PX} 0 1 1 ${BODY_PX} 0Z`;
}

/**
 * @param {number} angle_rad
 * @param {number} pxPerM
 */
function wedge(angle_rad, pxPerM) {
  const far = SIGHT_M * pxPerM,
    side = far * Math.sin(angle_rad / 2),
    ahead = far * Math.cos(angle_rad / 2);
  return `M0 0L${ahead} ${-side}A${far} ${far} 0 0 1 ${ahead} ${side}Z`;
}
