// Dialogs to answer, to choose and to read. Each returns a promise; null: the person cancelled.

import { find, make, makeButton, query } from "./dom.js";

/** @import { Prompt } from "./design_messages.d.ts" */
/** @import { Input } from "./design_types.d.ts" */

/**
 * Ask all of `asks`; resolves to the answers in their order, or to null.
 *
 * @param {string} title
 * @param {string} doc
 * @param {Prompt[]} asks
 * @param {string} [refused] Why earlier answers were not taken.
 * @returns {Promise<string[] | null>}
 */
export function ask(title, doc, asks, refused = "") {
  const dialog = find("ask", HTMLDialogElement),
    form = find("ask-form", HTMLFormElement),
    cancel = find("ask-cancel", HTMLButtonElement);
  find("ask-title").textContent = title;
  find("ask-doc").textContent = doc;
  find("ask-refused").textContent = refused;
  const fields = asks.map((asked, number) => field(asked, `answer-${number}`));
  find("ask-fields").replaceChildren(...fields.map((one) => one.label));
  const first = fields[0]?.input;
  return new Promise((resolve) => {
    const close = (/** @type {string[] | null} */ answers) => {
      dialog.onclose = form.onsubmit = cancel.onclick = null;
      dialog.close();
      resolve(answers);
    };
    form.onsubmit = (event) => {
      event.preventDefault();
      close(fields.map((one) => one.input.value));
    };
    cancel.onclick = () => close(null);
    dialog.onclose = () => {
      if (!dialog.open) close(null); // else the event is late: the dialog was shown again meanwhile
    };
    dialog.showModal();
    (first ?? find("ask-done")).focus();
    if (first instanceof HTMLInputElement) first.select();
  });
}

/**
 * Let a person choose one of `options`; resolves to it, or to null.
 *
 * @template {{ label: string, doc: string }} Option
 * @param {string} title
 * @param {Option[]} options
 * @returns {Promise<Option | null>}
 */
export function choose(title, options) {
  const dialog = find("choose", HTMLDialogElement),
    filter = find("choose-find", HTMLInputElement),
    list = find("choose-list");
  find("choose-title").textContent = title;
  filter.value = "";
  return new Promise((resolve) => {
    const close = (/** @type {Option | null} */ option) => {
      dialog.onclose = filter.oninput = filter.onkeydown = null;
      dialog.close();
      resolve(option);
    };
    const fill = () => {
      const part = filter.value.trim().toLowerCase();
      const shown = options.filter((one) => one.label.toLowerCase().includes(part));
      list.replaceChildren(...shown.map((one) => item(one, () => close(one))));
    };
    filter.oninput = fill;
    filter.onkeydown = (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      query(list, "button", HTMLButtonElement)?.click();
    };
    dialog.onclose = () => {
      if (!dialog.open) close(null); // else the event is late: the dialog was shown again meanwhile
    };
    fill();
    dialog.showModal();
    filter.focus();
  });
}

/**
 * Show a text, from a line on.
 *
 * @param {string} title
 * @param {string} text
 * @param {number} [line]
 */
export function read(title, text, line = 1) {
  find("reading-title").textContent = title;
  const shown = find("reading-text");
  shown.textContent = text;
  find("reading", HTMLDialogElement).showModal();
  shown.scrollTop = (shown.scrollHeight * (line - 1)) / Math.max(1, text.split("\n").length);
}

/**
 * Makes an input, or a select if the choices can be listed.
 *
 * @param {string[]} choices
 * @returns {Input}
 */
export function makeInput(choices) {
  const input = make(choices.length ? "select" : "input");
  if (input instanceof HTMLSelectElement) input.append(...choices.map((one) => new Option(one, one)));
  input.autocomplete = "off";
  return input;
}

/**
 * @param {{ label: string, doc: string }} option
 * @param {() => void} choose
 */
function item(option, choose) {
  const made = make("li");
  made.append(makeButton(option.label, choose), make("span", "quiet", option.doc));
  return made;
}

/**
 * A labelled input; Enter in a select is the form's, as in any other.
 *
 * @param {Prompt} asked
 * @param {string} id
 */
function field(asked, id) {
  const label = make("label"),
    input = makeInput(asked.choices);
  input.id = id;
  input.name = asked.name;
  input.value = asked.proposed;
  input.required = asked.is_required;
  if (input instanceof HTMLSelectElement) {
    input.onkeydown = (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      input.form?.requestSubmit();
    };
  }
  label.append(make("span", "", asked.name), input, make("span", "quiet", asked.doc));
  return { label, input };
}
