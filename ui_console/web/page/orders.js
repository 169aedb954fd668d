// The orders of this operator's robots, as text, each with a button that ends it.

import { keepingFocus, make, makeButton } from "./dom.js";

/** @import { OrderView } from "./messages.d.ts" */
/** @import { Act } from "./types.d.ts" */

/** A list that changes only when an order does, so that no button moves under a finger. */
export class Orders {
  /** @param {{ list: HTMLElement, act: Act }} given */
  constructor({ list, act }) {
    this.list = list;
    this.act = act;
    this.shown = "";
  }

  /** @param {OrderView[]} orders */
  show(orders) {
    const shown = JSON.stringify(orders);
    if (shown === this.shown) return;
    this.shown = shown;
    this.list.hidden = orders.length === 0;
    keepingFocus(this.list, () => this.list.replaceChildren(...orders.map((order) => this.row(order))));
  }

  /** @param {OrderView} order */
  row(order) {
    const row = make("li", isOver(order) ? "is-over" : "");
    row.dataset.order = order.robot;
    row.append(make("span", "", order.line));
    if (isOver(order)) return row;
    const end = makeButton("Stop order", () => this.act("end_orders", "", { robots: [order.robot] }));
    end.dataset.key = `end:${order.robot}`;
    end.setAttribute("aria-label", `Stop the order of ${order.robot}`);
    row.append(end);
    return row;
  }
}

/**
 * Whether the order is over.
 *
 * @param {OrderView} order
 */
export function isOver(order) {
  return order.state === "done" || order.state === "failed" || order.state === "ended";
}

/**
 * The robot that the stick can take back from its order; empty: none.
 *
 * @param {OrderView[]} orders
 * @param {string} robot The one that the stick is at.
 */
export function atStick(orders, robot) {
  return orders.find((order) => order.robot === robot && !isOver(order))?.robot ?? "";
}
