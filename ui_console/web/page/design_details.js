// The chosen element: its properties, and its problems.

import { makeInput } from "./design_dialogs.js";
import { keyOf } from "./design_tree.js";
import { find, keepingFocus, make, makeButton } from "./dom.js";

/** @import { ElementView, ProblemRow, Property } from "./design_messages.d.ts" */
/** @import { Input, Path } from "./design_types.d.ts" */

/**
 * The field of a property: the present value, and the last sent value that is not applied yet.
 *
 * @typedef {{ path: Path, property: Property, input: Input, refused: HTMLElement, is: string,
 *   said: string | null }} Field
 */

/**
 * Properties of the chosen element; `set(path, property, value)` is called when a field was changed. A refused value
 * stays in its field, marked, until it is changed; Escape brings back the value that is set.
 */
export class Details {
  /**
   * @param {{ form: HTMLFormElement,
   *   set: (path: Path, property: Property, value: string) => void }} given
   */
  constructor({ form, set }) {
    this.form = form;
    this.set = set;
    this.shape = "";
    /** @type {Path} */
    this.path = [];
    /** @type {Map<string, Field>} */
    this.fields = new Map();
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      for (const field of this.fields.values()) this.commit(field);
    });
  }

  /**
   * @param {ElementView} element
   * @param {string[]} problems
   */
  show(element, problems) {
    find("details-title").textContent = `${element.tag} ${element.told}`.trim();
    find("details-doc").textContent = element.doc;
    find("details-problems").replaceChildren(...problems.map((one) => make("li", "", one)));
    find("type-doc").hidden = element.type_doc.length === 0;
    find("type-doc-text").textContent = element.type_doc.join("\n");
    this.path = element.path;
    const kinds = element.properties.map((one) => [one.name, one.is_parameter, one.choices, one.doc]);
    const shape = JSON.stringify([element.path, kinds]);
    if (shape !== this.shape) keepingFocus(this.form, () => this.rebuild(element));
    this.shape = shape;
    for (const one of element.properties) this.fill(one);
  }

  /** @param {ElementView} element */
  rebuild({ path, properties }) {
    const set = make("button", "", "Set"); // Enter presses it
    set.hidden = properties.length === 0;
    this.fields = new Map(properties.map((one) => [propertyKey(one), this.field(path, one)]));
    const labels = [...this.fields.values()].map((field) => labelled(field));
    this.form.replaceChildren(...labels, set);
  }

  /**
   * @param {Path} path
   * @param {Property} property
   */
  field(path, property) {
    const input = makeInput(property.choices.length ? ["", ...property.choices] : []);
    input.dataset.key = propertyKey(property);
    input.spellcheck = false;
    /** @type {Field} */
    const field = { path, property, input, refused: make("span", "refused"), is: "", said: null };
    input.onchange = () => this.commit(field);
    input.oninput = () => mark(field, "");
    input.onkeydown = (event) => {
      if (event.key === "Escape") takeBack(field);
    };
    return field;
  }

  /**
   * Send the value of a field, once.
   *
   * @param {Field} field
   */
  commit(field) {
    const { value } = field.input;
    if (value === (field.said ?? field.is)) return;
    field.said = value;
    this.set(field.path, field.property, value);
  }

  /**
   * Show the refusal of a value at its field.
   *
   * @param {Path} path
   * @param {{ name: string, is_parameter?: boolean }} property
   * @param {string} value
   * @param {string} why
   */
  refused(path, property, value, why) {
    const field = keyOf(path) === keyOf(this.path) ? this.fields.get(propertyKey(property)) : undefined;
    if (!field || (field.input.value !== value && field.input === document.activeElement)) return;
    field.said = null;
    field.input.value = value;
    mark(field, why);
  }

  /**
   * Show the value, unless a person is typing another one, or a refused value is unchanged since.
   *
   * @param {Property} one
   */
  fill(one) {
    const field = this.fields.get(propertyKey(one));
    if (!field) return;
    const { input, is: was } = field;
    const value = one.value ?? "";
    const isWriting = input === document.activeElement && input.value !== was;
    const isRefused = input.getAttribute("aria-invalid") === "true" && value === was;
    const nothing = one.is_missing ? "missing" : one.default === null ? "" : `${one.default} (default)`;
    if (input instanceof HTMLSelectElement) {
      if (value && ![...input.options].some((each) => each.value === value)) input.append(new Option(value, value));
      input.options[0].textContent = nothing || "–";
    } else input.placeholder = nothing;
    input.classList.toggle("is-missing", one.is_missing);
    field.is = value;
    if (input.value === value || !(isWriting || isRefused)) takeBack(field);
  }
}

/** @param {Field} field */
function labelled({ property, input, refused }) {
  const label = make("label");
  refused.setAttribute("role", "alert");
  const name = property.is_parameter ? `${property.name} (parameter)` : property.name;
  label.append(make("span", "name", name), input, refused, make("span", "quiet", property.doc));
  return label;
}

/**
 * @param {Field} field
 * @param {string} why
 */
function mark({ input, refused }, why) {
  if (why) input.setAttribute("aria-invalid", "true");
  else input.removeAttribute("aria-invalid");
  refused.textContent = why;
}

/** @param {Field} field */
function takeBack(field) {
  field.said = null;
  field.input.value = field.is;
  mark(field, "");
}

/** @param {{ name: string, is_parameter?: boolean }} property */
const propertyKey = ({ name, is_parameter }) => `${is_parameter ? "parameter " : ""}${name}`;

/**
 * Show all problems; `go(path)` is called with the element of a pressed one.
 *
 * @param {HTMLElement} root
 * @param {ProblemRow[]} rows
 * @param {(path: Path) => void} go
 */
export function showProblems(root, rows, go) {
  if (rows.length === 0) {
    root.replaceChildren(make("p", "", "None: check would say that it is fine."));
    return;
  }
  const list = make("ul");
  for (const one of rows) {
    const where = `${one.line}:${one.column}`;
    const press = makeButton(`${one.message} (${one.remedy})`, () => go(one.path), `problem ${where}`);
    press.className = "problem";
    press.prepend(make("span", "quiet", `${where} `));
    const item = make("li");
    item.append(press);
    list.append(item);
  }
  root.replaceChildren(list);
}
