// The commands of the held robot: a button for each, with sliders, switches and selects for its fields.

import { make, makeButton } from "./dom.js";
import { set } from "./text.js";

/** @import { ArcAbilities, FieldForm, RoleCommand } from "./messages.d.ts" */

/** @typedef {string | number | boolean} Value Of a field. */

const UNLIMITED = 1e18; // the limit of all numbers on the bus
const EXACT = 2 ** 53; // the server reads no larger whole number
const STEPS = 100; // chosen: a slider is not finer than a finger

/**
 * The kind of control for a field. Pure.
 *
 * @param {Pick<FieldForm, "kind" | "least" | "most" | "choices">} field
 * @returns {"switch" | "select" | "slider" | "number" | "text"}
 */
export function controlOf({ kind, least, most, choices }) {
  if (kind === "flag") return "switch";
  if (choices.length > 0) return "select";
  if (kind !== "number" && kind !== "whole") return "text";
  return least > -UNLIMITED && most < UNLIMITED ? "slider" : "number";
}

/**
 * The smallest change of a number's control. Pure.
 *
 * @param {Pick<FieldForm, "kind" | "least" | "most" | "choices">} field
 */
export function stepOf(field) {
  if (field.kind === "whole") return "1";
  return controlOf(field) === "slider" ? String((field.most - field.least) / STEPS) : "any";
}

/**
 * The initial value of a field: its default, or else the value in its range nearest to 0. Pure.
 *
 * @param {Pick<FieldForm, "kind" | "least" | "most" | "choices" | "default" | "is_required">} field
 * @returns {Value}
 */
export function firstOf(field) {
  if (!field.is_required) return field.default;
  if (field.kind === "flag") return false;
  if (field.choices.length > 0) return field.choices[0];
  return field.kind === "text" ? "" : Math.min(Math.max(0, field.least), field.most);
}

/** Shows the commands of the abilities; `give(word, values, role)` sends a command. */
export class Commands {
  /**
   * @param {{ root: HTMLFieldSetElement, give: (word: string, values: Record<string, Value>, role: string) => void }}
   *   given
   */
  constructor({ root, give }) {
    this.root = root;
    this.give = give;
    this.shown = "";
    /** @type {RoleCommand[]} */
    this.commands = [];
  }

  /**
   * Draw these commands, unless they are already shown; a person's settings stay as long as the commands do.
   *
   * @param {ArcAbilities | null} abilities
   */
  know(abilities) {
    const commands = abilities?.commands ?? [];
    const told = JSON.stringify(commands);
    if (told === this.shown) return;
    this.shown = told;
    this.commands = commands;
    this.root.replaceChildren(make("legend", "", "Commands"), ...commands.map((one) => this.draw(one)));
    this.root.hidden = commands.length === 0;
  }

  /** @param {boolean} isOn */
  turn(isOn) {
    this.root.disabled = !isOn;
  }

  /**
   * Send the first command with this word that needs no values; return whether there is one.
   *
   * @param {string} word
   */
  giveByWord(word) {
    const found = this.commands.find(({ form }) => form.word === word && !form.fields.some((one) => one.is_required));
    if (found) this.give(word, {}, found.role);
    return found !== undefined;
  }

  /** @param {RoleCommand} command */
  draw(command) {
    const { form, role, labels } = command;
    const title = command.title.charAt(0).toUpperCase() + command.title.slice(1);
    if (form.fields.length === 0) {
      const button = makeButton(title, () => this.give(form.word, {}, role));
      button.title = form.doc;
      return button;
    }
    const drawn = make("form", "command");
    drawn.setAttribute("aria-label", title);
    const controls = form.fields.map((field, number) => new Control(field, labels[number]));
    const button = make("button", "", title);
    button.title = form.doc;
    const fields = make("div", "fields");
    fields.append(...controls.map((one) => one.root));
    drawn.append(fields, button);
    drawn.addEventListener("submit", (event) => {
      event.preventDefault();
      const values = controls.filter((one) => one.isSet).map((one) => /** @type {const} */ ([one.name, one.value]));
      this.give(form.word, Object.fromEntries(values), role);
    });
    return drawn;
  }
}

/** A field of a command, with its label. While it has the focus, the keys that it needs do not drive. */
class Control {
  /**
   * @param {FieldForm} field
   * @param {string} label
   */
  constructor(field, label) {
    this.name = field.name;
    this.kind = controlOf(field);
    this.isRequired = field.is_required;
    this.root = make("label");
    this.shown = make("span"); // an output element would claim the label
    this.shown.setAttribute("aria-hidden", "true");
    this.input = this.kind === "select" ? selectOf(field) : inputOf(field, this.kind);
    this.input.dataset.keys = "own";
    this.root.append(label, this.shown, this.input);
    if (field.doc) this.root.append(make("small", "quiet", field.doc));
    this.input.addEventListener("input", () => this.show());
    this.input.addEventListener("pointerup", () => {
      if (this.kind === "slider") this.input.blur(); // arrows drive again
    });
    this.show();
  }

  show() {
    if (this.kind === "slider") set(this.shown, String(Number(Number(this.input.value).toPrecision(3))));
  }

  get isSet() {
    return this.isRequired || this.kind === "switch" || this.input.value !== "";
  }

  /** @returns {Value} */
  get value() {
    const input = this.input;
    if (this.kind === "switch") return input instanceof HTMLInputElement && input.checked;
    return this.kind === "slider" || this.kind === "number" ? Number(input.value) : input.value;
  }
}

/** @param {FieldForm} field */
function selectOf(field) {
  const select = make("select");
  select.append(...field.choices.map((choice) => new Option(choice, choice)));
  select.value = String(firstOf(field));
  return select;
}

/**
 * @param {FieldForm} field
 * @param {string} kind
 */
function inputOf(field, kind) {
  const input = make("input");
  const first = firstOf(field);
  input.type = { switch: "checkbox", slider: "range", number: "number" }[kind] ?? "text";
  input.required = field.is_required && kind !== "switch";
  if (kind === "slider" || kind === "number") {
    input.min = String(Math.max(field.least, -EXACT));
    input.max = String(Math.min(field.most, EXACT));
    input.step = stepOf(field);
  }
  if (kind === "switch") {
    input.setAttribute("role", "switch");
    input.checked = first === true;
  } else input.value = String(first);
  return input;
}
