// Parts, details, problems and the first minute.

const SVG = "http://www.w3.org/2000/svg";
const COLORS = 6;
const find = (id) => document.getElementById(id);

// ---------------------------------------------------------------- parts
/** What can be dragged into the mission; `add(label)` adds it to the chosen element, `learn(type)` asks its class. */
export class Palette {
  constructor({ root, filter, add, read, learn }) {
    Object.assign(this, { root, filter, add, read, learn });
    this.rows = [];
    filter.addEventListener("input", () => this.draw());
    filter.addEventListener("keydown", (event) => {
      if (event.key === "Enter") root.querySelector(".part button")?.click();
      if (event.key === "ArrowDown") root.querySelector(".part button")?.focus();
    });
  }

  show(rows) {
    this.rows = rows;
    this.draw();
  }

  draw() {
    const focus = this.root.contains(document.activeElement) ? document.activeElement.dataset.key : "";
    const wanted = this.filter.value.trim().toLowerCase();
    const groups = new Map();
    for (const row of this.rows) {
      if (!`${row.label} ${row.group}`.toLowerCase().includes(wanted)) continue;
      if (!groups.has(row.group)) groups.set(row.group, []);
      groups.get(row.group).push(this.made(row));
    }
    this.root.replaceChildren(
      ...[...groups].map(([name, parts]) => {
        const group = document.createElement("section"),
          head = document.createElement("h3");
        head.textContent = name;
        group.append(head, ...parts);
        return group;
      }),
    );
    if (focus) this.root.querySelector(`[data-key="${CSS.escape(focus)}"]`)?.focus();
  }

  made(row) {
    const made = document.createElement("div");
    made.className = `part tag-${row.tag}`;
    made.dataset.drag = "part";
    made.dataset.label = row.label;
    made.dataset.tag = row.tag;
    const name = document.createElement("span");
    name.className = "name";
    name.textContent = row.name;
    const handle = document.createElement("span");
    handle.className = "handle";
    handle.textContent = "⠿";
    handle.setAttribute("aria-hidden", "true");
    const add = button("Add", `add ${row.label}`, () => this.add(row.label));
    add.setAttribute("aria-label", `Add ${row.label}`);
    const about = button("?", `about ${row.label}`, () =>
      row.is_known ? this.read(row.name, row.doc.join("\n")) : this.learn(row.type),
    );
    about.setAttribute("aria-label", `About ${row.label}`);
    made.append(handle, name, about, add);
    return made;
  }
}

// ---------------------------------------------------------------- details
/**
 * What can be set of the chosen element; `set(path, property, value)` is called when a field was changed. A value that was
 * refused stays in its field, marked, until it is changed; Escape brings back what is set.
 */
export class Details {
  constructor({ form, set }) {
    Object.assign(this, { form, set });
    this.shape = this.path = "";
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      for (const input of form.querySelectorAll("input, select")) this.commit(input);
    });
  }

  show(element, problems) {
    find("details-title").textContent = `${element.tag} ${element.told}`.trim();
    find("details-doc").textContent = element.doc;
    find("details-problems").replaceChildren(...problems.map((one) => listed(one)));
    find("type-doc").hidden = element.type_doc.length === 0;
    find("type-doc").querySelector("pre").textContent = element.type_doc.join("\n");
    this.path = element.path.join("/");
    const kinds = element.properties.map((one) => [one.name, one.is_parameter, one.choices, one.doc]);
    const shape = JSON.stringify([element.path, kinds]);
    if (shape !== this.shape) this.rebuild(element);
    this.shape = shape;
    for (const one of element.properties) this.fill(one);
  }

  rebuild(element) {
    const focus = this.form.contains(document.activeElement) ? document.activeElement.dataset.key : "";
    const set = document.createElement("button");
    set.textContent = "Set"; // what Enter presses
    this.properties = new Map(element.properties.map((one) => [keyOf(one), one]));
    this.form.replaceChildren(...element.properties.map((one) => this.field(one)), set);
    set.hidden = element.properties.length === 0;
    if (focus) this.input(focus)?.focus();
  }

  field(one) {
    const label = document.createElement("label");
    const input = one.choices.length ? document.createElement("select") : document.createElement("input");
    if (one.choices.length) input.append(new Option("", ""), ...one.choices.map((each) => new Option(each, each)));
    input.dataset.key = keyOf(one);
    input.dataset.path = this.path;
    input.autocomplete = "off";
    input.spellcheck = false;
    input.addEventListener("change", () => this.commit(input));
    input.addEventListener("input", () => this.mark(input, ""));
    input.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.takeBack(input);
    });
    const refused = line("refused", "");
    refused.setAttribute("role", "alert");
    label.append(
      line("name", one.is_parameter ? `${one.name} (parameter)` : one.name),
      input,
      refused,
      line("quiet", one.doc),
    );
    return label;
  }

  input(key) {
    return this.form.querySelector(`[data-key="${CSS.escape(key)}"]`);
  }

  /** Have the value set that is written in a field, once. */
  commit(input) {
    const { key, path, said, is } = input.dataset;
    if (input.value === (said ?? is ?? "")) return;
    input.dataset.said = input.value;
    this.set(path === "" ? [] : path.split("/").map(Number), this.properties.get(key), input.value);
  }

  /** A value was not taken: say so where it stands. */
  refused(path, one, value, why) {
    const input = path.join("/") === this.path ? this.input(keyOf(one)) : null;
    if (input === null || (input.value !== value && input === document.activeElement)) return;
    delete input.dataset.said;
    input.value = value;
    this.mark(input, why);
  }

  mark(input, why) {
    if (why) input.setAttribute("aria-invalid", "true");
    else input.removeAttribute("aria-invalid");
    input.parentElement.querySelector(".refused").textContent = why;
  }

  takeBack(input) {
    delete input.dataset.said;
    input.value = input.dataset.is ?? "";
    this.mark(input, "");
  }

  /** Show the value, unless another one is just being written, or was refused and nothing has changed since. */
  fill(one) {
    const input = this.input(keyOf(one)),
      value = one.value ?? "",
      was = input.dataset.is ?? "";
    const isWriting = input === document.activeElement && input.value !== was;
    const isRefused = input.getAttribute("aria-invalid") === "true" && value === was;
    const nothing = one.is_missing ? "missing" : one.default === null ? "" : `${one.default} (default)`;
    if (input.tagName === "SELECT") {
      if (value && ![...input.options].some((each) => each.value === value)) input.append(new Option(value, value));
      input.options[0].textContent = nothing || "–";
    } else input.placeholder = nothing;
    input.classList.toggle("is-missing", one.is_missing);
    input.dataset.is = value;
    if (input.value === value || !(isWriting || isRefused)) this.takeBack(input);
  }
}

function line(className, text) {
  const made = document.createElement("span");
  made.className = className;
  made.textContent = text;
  return made;
}

const keyOf = (one) => `${one.is_parameter ? "parameter " : ""}${one.name}`;

// ---------------------------------------------------------------- problems
export function showProblems(root, rows, go) {
  if (rows.length === 0) {
    root.replaceChildren(paragraph("None: check would say that it is fine."));
    return;
  }
  const list = document.createElement("ul");
  list.append(
    ...rows.map((one) => {
      const item = document.createElement("li");
      const press = button(`${one.message} (${one.remedy})`, `problem ${one.line}:${one.column}`, () => go(one.path));
      press.className = "problem";
      const where = document.createElement("span");
      where.className = "quiet";
      where.textContent = `${one.line}:${one.column} `;
      press.prepend(where);
      item.append(press);
      return item;
    }),
  );
  root.replaceChildren(list);
}

// ---------------------------------------------------------------- the first minute
export function showMinute(root, minute) {
  if (minute === undefined) {
    root.replaceChildren(paragraph("…"));
    return;
  }
  if (minute === null) {
    root.replaceChildren(paragraph("It has problems; a dry run needs a mission that check says is fine."));
    return;
  }
  if (minute.rows.length === 0) {
    root.replaceChildren(paragraph("Nobody asks for anything."));
    return;
  }
  const lines = document.createElement("ul");
  lines.append(...minute.never.map((one) => listed(one, "failure")), ...minute.told.map((one) => listed(one)));
  root.replaceChildren(chart(minute), lines);
}

function chart(minute) {
  const height = 24,
    left = 170,
    width = 830,
    arcs = minute.rows.filter((row) => row.is_arc).map((row) => row.name);
  const color = (arc) => `color-${Math.max(0, arcs.indexOf(arc)) % COLORS}`;
  const at = (time) => left + (width * time) / minute.end_s;
  const svg = drawn("svg", {
    class: "minute",
    viewBox: `0 0 ${left + width} ${height * minute.rows.length + 20}`,
    role: "img",
    "aria-label": `who runs when in the first ${minute.end_s} s`,
  });
  minute.rows.forEach((row, number) => {
    const top = number * height;
    svg.append(drawn("text", { x: 4, y: top + 16 }, row.name.slice(0, 24)));
    for (const turn of row.turns) {
      const title = drawn("title", {}, `${turn.who}: ${turn.open_s.toFixed(1)} s to ${turn.to_s.toFixed(1)} s`);
      const bar = drawn("rect", {
        x: at(turn.open_s),
        y: top + 3,
        width: Math.max(0.5, at(turn.to_s) - at(turn.open_s)),
        height: height - 6,
        rx: 2,
        class: color(row.is_arc ? row.name : turn.who),
      });
      bar.append(title);
      svg.append(
        drawn("rect", {
          x: at(turn.from_s),
          y: top + 8,
          width: Math.max(0, at(turn.open_s) - at(turn.from_s)),
          height: height - 16,
          class: "settles",
        }),
        bar,
      );
    }
  });
  for (let time = 0; time <= minute.end_s; time += 10)
    svg.append(drawn("text", { x: at(time) - (time ? 16 : 0), y: height * minute.rows.length + 15 }, `${time} s`));
  return svg;
}

function drawn(tag, attributes, text = "") {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text) made.textContent = text;
  return made;
}

function button(text, key, press) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.dataset.key = key;
  made.addEventListener("click", press);
  return made;
}

function paragraph(text) {
  const made = document.createElement("p");
  made.textContent = text;
  return made;
}

function listed(text, className = "") {
  const made = document.createElement("li");
  made.textContent = text;
  if (className) made.className = className;
  return made;
}
