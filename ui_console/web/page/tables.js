// Tables of the mission. What is shown was decided by the console model; here it only becomes rows.

const SVG = "http://www.w3.org/2000/svg";
const NAMES = ["alarms", "robots", "tree", "schedule", "timeline", "links", "parameters", "components", "log"];
const NOTHING = { alarms: "none", tree: "no behavior is known yet", parameters: "ask a component for its parameters" };

export class Tables {
  constructor({ tabs, panel, act }) {
    Object.assign(this, { tabs, panel, act });
    this.chosen = "alarms";
    this.view = {};
    this.buttons = new Map();
    for (const name of NAMES) {
      const button = document.createElement("button");
      button.type = "button";
      button.id = `tab-${name}`;
      button.textContent = name;
      button.setAttribute("role", "tab");
      button.setAttribute("aria-controls", panel.id);
      button.addEventListener("click", () => this.choose(name));
      tabs.append(button);
      this.buttons.set(name, button);
    }
    tabs.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const next = NAMES[(NAMES.indexOf(this.chosen) + step + NAMES.length) % NAMES.length];
      this.choose(next);
      this.buttons.get(next).focus();
    });
    this.choose(this.chosen);
  }

  choose(name) {
    this.chosen = name;
    for (const [other, button] of this.buttons) {
      button.setAttribute("aria-selected", String(other === name));
      button.tabIndex = other === name ? 0 : -1;
    }
    this.panel.setAttribute("aria-labelledby", `tab-${name}`);
    this.shown = "";
    this.draw();
  }

  show(view, changed) {
    this.view = view;
    const alarms = (view.alarms ?? []).filter((alarm) => !alarm.acknowledged_by).length;
    const label = alarms ? `alarms (${alarms})` : "alarms";
    if (this.buttons.get("alarms").textContent !== label) this.buttons.get("alarms").textContent = label;
    const section = this.chosen === "schedule" ? "requests" : this.chosen;
    if (section in changed) this.draw();
  }

  draw() {
    if (this.panel.querySelector("input:focus, button:active")) return; // somebody is typing or pressing here
    const section = this.chosen === "schedule" ? "requests" : this.chosen;
    const rows = this.view[section];
    if (rows === undefined) return;
    const focus = document.activeElement?.dataset?.key;
    if (section === "timeline") this.panel.replaceChildren(timeline(rows));
    else this.panel.replaceChildren(rows.length ? this[section](rows) : paragraph(NOTHING[this.chosen] ?? "nothing yet"));
    if (focus) this.panel.querySelector(`[data-key="${CSS.escape(focus)}"]`)?.focus();
  }

  alarms(rows) {
    const all = this.button("Seen all", "acknowledge:", () => this.act("acknowledge", ""));
    return table(["", "what", "since", "times", all], rows.map((row) => [
      span(row.severity, row.is_active ? `${row.severity}, now` : row.severity),
      `${row.line}${row.remedy ? ` — ${row.remedy}` : ""}${row.while_away ? " (while away)" : ""}`,
      seconds(row.first_s), String(row.count),
      row.acknowledged_by ? `seen by ${row.acknowledged_by}` : this.button("Seen", `acknowledge:${row.key}`, () => this.act("acknowledge", row.key)),
    ]));
  }

  robots(rows) {
    return table(["robot", "holder", "priority", "since", "slice ends", "lease left", "because", "waiting"], rows.map((row) => [
      row.robot, row.is_mine ? "you" : row.holder || "–", row.priority, seconds(row.since_s), seconds(row.until_s),
      seconds(row.lease_left_s), row.because, row.waiting.map((one) => one.who).join(", "),
    ]));
  }

  tree(rows) {
    return table(["behavior", "state", "priority", "does", "because", ""], rows.map((row) => [
      "\u2003".repeat(row.depth) + row.name, span(row.state, row.state), row.priority === null ? "" : String(row.priority),
      row.feedback, row.because, this.more(row.name),
    ]));
  }

  requests(rows) {
    return table(["who", "state", "resources", "priority", "since", "until", "expected", "because", ""], rows.map((row) => [
      row.who, span(row.state, row.state), row.rcs.join(" "), row.priority, seconds(row.since_s), seconds(row.until_s),
      seconds(row.expected_start_s), row.because, this.button("Why?", `why:${row.arc}`, () => this.act("why", row.arc)),
    ]));
  }

  links(rows) {
    return table(["link", "", "there and back", "more"], rows.map((row) => [
      row.name, span(row.is_up ? "running" : "lost", row.is_up ? "up" : "DOWN"),
      row.latency_s < 0 ? "" : `${(1000 * row.latency_s).toFixed(0)} ms`, row.feedback,
    ]));
  }

  parameters(rows) {
    return table(["component", "parameter", "value", "before", "changed by"], rows.map((row) => {
      const input = document.createElement("input");
      input.value = row.value;
      input.dataset.key = `set:${row.component}.${row.name}`;
      input.setAttribute("aria-label", `${row.component} ${row.name}`);
      input.addEventListener("keydown", (event) => {
        if (event.key !== "Enter") return;
        let value = input.value;
        try { value = JSON.parse(value); } catch { /* it is text as it stands */ }
        input.blur();
        this.act("set", row.component, { parameter: row.name, value });
      });
      return [row.component, row.name, input, row.before, row.changed_by];
    }));
  }

  components(rows) {
    return table(["component", "type", "host", "pid", "state", "does", ""], rows.map((row) => [
      row.name, row.type, row.host, String(row.pid), row.state, row.feedback, this.more(row.name),
    ]));
  }

  log(rows) {
    return table(["at", "about", "what", "told by"], [...rows].reverse().map((row) => [seconds(row.at_s), row.subject, row.what, row.where]));
  }

  more(name) {
    const both = document.createElement("span");
    both.append(
      this.button("Why?", `why:${name}`, () => this.act("why", name)), " ",
      this.button("Parameters", `parameters:${name}`, () => { this.act("parameters", name); this.choose("parameters"); }),
    );
    return both;
  }

  button(label, key, press) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = label;
    button.dataset.key = key;
    button.addEventListener("click", press);
    return button;
  }
}

function table(heads, rows) {
  const made = document.createElement("table");
  const head = made.createTHead().insertRow();
  for (const one of heads) {
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.append(one);
    head.append(cell);
  }
  const body = made.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    for (const one of row) line.insertCell().append(one);
  }
  return made;
}

function timeline(view) {
  const height = 26, left = 120, width = 900;
  const svg = node("svg", { class: "timeline", viewBox: `0 0 ${left + width} ${height * view.rows.length + 20}`, role: "img", "aria-label": "who had which resource, who has it, who comes next" });
  const at = (time) => left + (width * (Math.max(view.from_s, Math.min(view.to_s, time)) - view.from_s)) / (view.to_s - view.from_s);
  view.rows.forEach((row, number) => {
    const top = number * height;
    svg.append(node("text", { x: 4, y: top + 17 }, row.rc));
    for (const slice of row.slices) {
      const [from, to] = [at(slice.from_s), at(slice.to_s)];
      const bar = node("rect", { x: from, y: top + 3, width: Math.max(1, to - from), height: height - 6, rx: 3, class: `${slice.certainty}${slice.is_console ? " console" : ""}` });
      bar.append(node("title", {}, `${slice.who}: ${seconds(slice.from_s)} to ${seconds(slice.to_s)}`));
      svg.append(bar);
      if (to - from > 50) svg.append(node("text", { x: from + 4, y: top + 17 }, slice.who.slice(0, Math.floor((to - from) / 8))));
    }
  });
  const here = at(view.now_s);
  svg.append(node("line", { x1: here, x2: here, y1: 0, y2: height * view.rows.length, class: "here" }));
  svg.append(node("text", { x: here - 30, y: height * view.rows.length + 15 }, seconds(view.now_s)));
  return svg;
}

function node(tag, attributes, text = "") {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text) made.textContent = text;
  return made;
}

function span(className, text) {
  const made = document.createElement("span");
  made.className = className;
  made.textContent = text;
  return made;
}

function paragraph(text) {
  const made = document.createElement("p");
  made.textContent = text;
  return made;
}

export function seconds(time) {
  return time < 0 ? "" : `${time.toFixed(1)} s`;
}
