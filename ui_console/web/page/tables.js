// Tables of the mission. The console model decides their content; this file only makes rows of it.

import { keepingFocus, make, makeButton, stepped } from "./dom.js";
import { table } from "./table.js";
import { seconds, set } from "./text.js";
import { timeline } from "./timeline.js";

/** @import { AlarmView, ComponentState, LinkView, NodeView, ParameterView } from "./messages.d.ts" */
/** @import { RequestView, RobotView, View } from "./messages.d.ts" */
/** @import { Log } from "./log.js" */
/** @import { Act } from "./types.d.ts" */

const NAMES = ["alarms", "robots", "tree", "schedule", "timeline", "links", "parameters", "components", "log"];
/** @type {Record<string, string>} */
const NOTHING = { alarms: "none", tree: "no behavior is known yet", parameters: "ask a component for its parameters" };

export class Tables {
  /** @param {{ tabs: HTMLElement, panel: HTMLElement, act: Act, log: Log }} given */
  constructor({ tabs, panel, act, log }) {
    this.tabs = tabs;
    this.panel = panel;
    this.act = act;
    this.log = log;
    this.chosen = "alarms";
    /** @type {Partial<View>} */
    this.view = {};
    /** @type {Map<string, HTMLButtonElement>} */
    this.buttons = new Map();
    for (const name of NAMES) {
      const button = makeButton(name, () => this.choose(name));
      button.id = `tab-${name}`;
      button.setAttribute("role", "tab");
      button.setAttribute("aria-controls", panel.id);
      tabs.append(button);
      this.buttons.set(name, button);
    }
    tabs.addEventListener("keydown", (event) => this.step(event));
    addEventListener("resize", () => {
      if (this.chosen === "timeline") this.draw();
    });
    this.choose(this.chosen);
  }

  /**
   * Arrow keys switch tables, unless they drive.
   *
   * @param {KeyboardEvent} event
   */
  step(event) {
    const next = stepped(event.key, NAMES, this.chosen);
    if (next === null || event.defaultPrevented) return;
    event.preventDefault();
    this.choose(next);
    this.buttons.get(next)?.focus();
  }

  /** @param {string} name */
  choose(name) {
    this.chosen = name;
    for (const [other, button] of this.buttons) button.setAttribute("aria-selected", String(other === name));
    this.panel.setAttribute("aria-labelledby", `tab-${name}`);
    this.log.form.hidden = name !== "log";
    this.draw();
  }

  /**
   * @param {Partial<View>} view
   * @param {Partial<View>} changed
   */
  show(view, changed) {
    this.view = view;
    const tab = this.buttons.get("alarms");
    const alarms = (view.alarms ?? []).filter((alarm) => !alarm.acknowledged_by).length;
    if (tab) set(tab, alarms ? `alarms (${alarms})` : "alarms");
    const isFound = this.chosen === "log" && this.log.found !== null; // the result of a search does not change
    if (this.section in changed && !isFound) this.draw();
  }

  get section() {
    return /** @type {keyof View} */ (this.chosen === "schedule" ? "requests" : this.chosen);
  }

  /** Returns the content of the chosen table; none: it is not known yet. */
  content() {
    const view = this.view;
    if (view[this.section] === undefined) return [];
    switch (this.chosen) {
      case "log":
        return this.log.draw(view.log ?? []);
      case "timeline":
        return view.timeline ? [timeline(view.timeline, this.panel.clientWidth)] : [];
      case "alarms":
        return view.alarms?.length ? [this.alarms(view.alarms)] : this.nothing();
      case "robots":
        return view.robots?.length ? [this.robots(view.robots)] : this.nothing();
      case "tree":
        return view.tree?.length ? [this.tree(view.tree)] : this.nothing();
      case "schedule":
        return view.requests?.length ? [this.requests(view.requests)] : this.nothing();
      case "links":
        return view.links?.length ? [this.links(view.links)] : this.nothing();
      case "parameters":
        return view.parameters?.length ? [this.parameters(view.parameters)] : this.nothing();
      default:
        return view.components?.length ? [this.components(view.components)] : this.nothing();
    }
  }

  nothing() {
    return [make("p", "", NOTHING[this.chosen] ?? "nothing yet")];
  }

  draw() {
    const isPressed = this.panel.querySelector("input:focus, button:active") !== null;
    const isHeld = isPressed && this.chosen !== "log"; // a press in the log leads to another table
    this.panel.classList.toggle("is-held", isHeld); // while a person types or presses here, the table is not redrawn
    const content = isHeld ? [] : this.content();
    if (content.length === 0) return;
    keepingFocus(this.panel, () => this.panel.replaceChildren(...content));
  }

  /** @param {AlarmView[]} rows */
  alarms(rows) {
    const all = makeButton("Seen all", () => this.act("acknowledge", ""), "acknowledge:");
    return table(
      ["level", "what", "where", "since", "times", all],
      rows.map((row) => [
        make("span", row.severity, row.is_active ? `${row.severity}, now` : row.severity),
        told(row),
        [row.robot === row.subject ? "" : row.robot, row.where].filter(Boolean).join(", "),
        seconds(row.first_s),
        String(row.count),
        this.seenOrWhy(row),
      ]),
    );
  }

  /** @param {AlarmView} row */
  seenOrWhy(row) {
    const both = make("span");
    both.append(
      makeButton("Why?", () => this.act("why", row.subject), `why:${row.key}`, row.subject),
      " ",
      row.acknowledged_by
        ? `seen by ${row.acknowledged_by}`
        : makeButton("Seen", () => this.act("acknowledge", row.key), `acknowledge:${row.key}`, row.line),
    );
    return both;
  }

  /** @param {RobotView[]} rows */
  robots(rows) {
    const heads = ["robot", "stop", "holder", "priority", "since", "slice ends", "lease left", "because", "waiting"];
    return table(
      heads,
      rows.map((row) => [
        row.robot,
        row.stop ? make("span", "alarm", `STOPPED by ${row.stop.by_user}`) : "",
        row.is_mine ? "you" : row.holder || "–",
        row.priority,
        seconds(row.since_s),
        seconds(row.until_s),
        seconds(row.lease_left_s),
        row.because,
        row.waiting.join(", "),
      ]),
    );
  }

  /** @param {NodeView[]} rows */
  tree(rows) {
    return table(
      ["behavior", "state", "priority", "does", "because", "ask"],
      rows.map((row) => [
        "\u2003".repeat(row.depth) + row.name,
        make("span", row.state, row.state),
        row.priority === null ? "" : String(row.priority),
        row.feedback,
        row.because,
        this.more(row.name),
      ]),
    );
  }

  /** @param {RequestView[]} rows */
  requests(rows) {
    return table(
      ["who", "state", "resources", "priority", "since", "until", "expected", "because", "ask"],
      rows.map((row) => [
        row.owner,
        make("span", row.state, row.state),
        row.rcs.join(" "),
        row.priority,
        seconds(row.since_s),
        seconds(row.until_s),
        seconds(row.expected_start_s),
        row.because,
        makeButton("Why?", () => this.act("why", row.arc), `why:${row.arc}`, row.arc),
      ]),
    );
  }

  /** @param {LinkView[]} rows */
  links(rows) {
    return table(
      ["link", "state", "there and back", "more"],
      rows.map((row) => [
        row.name,
        make("span", row.is_up ? "running" : "lost", row.is_up ? "up" : "DOWN"),
        row.latency_s < 0 ? "" : `${(1000 * row.latency_s).toFixed(0)} ms`,
        row.feedback,
      ]),
    );
  }

  /** @param {ParameterView[]} rows */
  parameters(rows) {
    return table(
      ["component", "parameter", "value", "before", "changed by"],
      rows.map((row) => {
        const input = make("input");
        input.value = row.value;
        input.dataset.key = `set:${row.component}.${row.name}`;
        input.setAttribute("aria-label", `${row.component} ${row.name}`);
        input.addEventListener("keydown", (event) => {
          if (event.key !== "Enter") return;
          /** @type {unknown} */
          let value = input.value;
          try {
            value = JSON.parse(input.value);
          } catch {
            /* it is text as it stands */
          }
          input.blur();
          this.act("set", row.component, { parameter: row.name, value });
        });
        return [row.component, row.name, input, row.before, row.changed_by];
      }),
    );
  }

  /** @param {ComponentState[]} rows */
  components(rows) {
    return table(
      ["component", "type", "host", "pid", "state", "does", "ask"],
      rows.map((row) => {
        const name = row.address.slice(row.address.indexOf("/") + 1);
        return [name, row.type, row.host, String(row.pid), row.state, row.feedback, this.more(name)];
      }),
    );
  }

  /** @param {string} name */
  more(name) {
    const both = make("span");
    both.append(
      makeButton("Why?", () => this.act("why", name), `why:${name}`, name),
      " ",
      makeButton("Parameters", () => this.askParameters(name), `parameters:${name}`, `of ${name}`),
    );
    return both;
  }

  /** @param {string} name */
  askParameters(name) {
    this.act("parameters", name);
    this.choose("parameters");
  }
}

/** @param {AlarmView} alarm */
function told(alarm) {
  const remedy = alarm.remedy ? ` — ${alarm.remedy}` : "";
  const follows = alarm.also.length ? ` (and what follows from it: ${alarm.also.join("; ")})` : "";
  return `${alarm.line}${remedy}${alarm.while_away ? " (while away)" : ""}${follows}`;
}
