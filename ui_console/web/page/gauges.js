// Gauges of a robot: a bar for a value with a range, a lamp for a flag, text for other values.

import { make } from "./dom.js";
import { set } from "./text.js";

/** @import { GaugeView } from "./messages.d.ts" */

/**
 * How a value is drawn. Pure.
 *
 * @param {Pick<GaugeView, "share" | "flag">} gauge
 * @returns {"lamp" | "bar" | "words"}
 */
export function drawnAs({ share, flag }) {
  if (flag !== null) return "lamp";
  return share >= 0 ? "bar" : "words";
}

/**
 * The tooltip of a gauge: its range and its meaning. Pure.
 *
 * @param {Pick<GaugeView, "span" | "doc">} gauge
 */
export function hintOf({ span, doc }) {
  return [span, doc].filter(Boolean).join(": ");
}

/**
 * The values in the card's line: shares, such as a battery's charge. Pure.
 *
 * @param {Pick<GaugeView, "name" | "text" | "is_share">[]} gauges
 */
export function lineOf(gauges) {
  return gauges
    .filter((gauge) => gauge.is_share)
    .map((gauge) => `${gauge.name} ${gauge.text}`)
    .join(", ");
}

/** All values that a robot reports, foldable; the row of a value keeps its place while the value changes. */
export class Gauges {
  /** @param {string} robot */
  constructor(robot) {
    this.root = make("details", "reports");
    this.title = make("summary", "", "Reports");
    this.title.setAttribute("aria-label", `Reports of ${robot}`);
    this.rows = make("dl");
    this.root.append(this.title, this.rows);
    this.root.hidden = true;
    this.drawn = "";
    /** @type {Row[]} */
    this.shown = [];
  }

  /** @param {GaugeView[]} gauges */
  show(gauges) {
    this.root.hidden = gauges.length === 0;
    if (this.root.hidden) return; // its rows keep the place
    const kinds = gauges.map((gauge) => `${gauge.name} ${drawnAs(gauge)}`).join("\n");
    if (kinds !== this.drawn) {
      this.drawn = kinds;
      this.shown = gauges.map((gauge) => new Row(gauge));
      this.rows.replaceChildren(...this.shown.flatMap((row) => [row.name, row.value]));
    }
    this.shown.forEach((row, number) => {
      row.fill(gauges[number]);
    });
  }
}

class Row {
  /** @param {GaugeView} gauge */
  constructor(gauge) {
    this.name = make("dt", "", gauge.name);
    this.value = make("dd", drawnAs(gauge));
    this.text = make("span", "text");
    /** @type {HTMLMeterElement | null} */
    this.bar = null;
    if (drawnAs(gauge) === "bar") {
      this.bar = make("meter");
      this.bar.setAttribute("aria-label", gauge.name);
      this.value.append(this.bar);
    }
    this.span = make("small", "quiet");
    this.value.append(this.text, this.span);
  }

  /** @param {GaugeView} gauge */
  fill(gauge) {
    set(this.text, gauge.text);
    set(this.span, gauge.span);
    const hint = hintOf(gauge);
    if (this.value.title !== hint) this.value.title = hint;
    this.value.classList.toggle("is-on", gauge.flag === true);
    if (this.bar !== null && this.bar.value !== gauge.share) this.bar.value = gauge.share;
  }
}
