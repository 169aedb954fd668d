// Elements of the page, with their kinds.

/**
 * Returns the element of this id, which is on the page for sure.
 *
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @param {new () => T} [kind] None: any kind of element will do.
 * @returns {T}
 */
export function find(id, kind) {
  const found = document.getElementById(id);
  if (!(found instanceof (kind ?? HTMLElement))) throw new Error(`the page has no such element: ${id}`);
  return /** @type {T} */ (found);
}

/**
 * Makes an element.
 *
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {string} [className]
 * @param {string} [text]
 */
export function make(tag, className = "", text = "") {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}

/**
 * Makes a button that does this.
 *
 * @param {string} label
 * @param {() => void} press
 */
export function makeButton(label, press) {
  const button = make("button", "", label);
  button.type = "button";
  button.addEventListener("click", press);
  return button;
}
