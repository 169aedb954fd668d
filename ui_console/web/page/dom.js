// Functions that find and create elements of the page, with their types.

/**
 * Returns the element with this id, which must be on the page.
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
 * Makes a button with this action; with a key it keeps the focus when it is redrawn, see `keepingFocus`.
 *
 * @param {string} label
 * @param {() => void} press
 * @param {string} [key]
 * @param {string} [about] What it is about, for those who hear its name.
 */
export function makeButton(label, press, key = "", about = "") {
  const button = make("button", "", label);
  button.type = "button";
  if (about) button.setAttribute("aria-label", `${label} ${about}`);
  if (key) button.dataset.key = key;
  button.addEventListener("click", press);
  return button;
}

/**
 * Returns the first element in `root` that matches a selector; null: there is none, or it has another type.
 *
 * @template {Element} T
 * @param {ParentNode} root
 * @param {string} selector
 * @param {new () => T} kind
 * @returns {T | null}
 */
export function query(root, selector, kind) {
  const found = root.querySelector(selector);
  return found instanceof kind ? found : null;
}

/**
 * Returns all elements of a type in `root` that match a selector.
 *
 * @template {Element} T
 * @param {ParentNode} root
 * @param {string} selector
 * @param {new () => T} kind
 * @returns {T[]}
 */
export function queryAll(root, selector, kind) {
  return [...root.querySelectorAll(selector)].flatMap((one) => (one instanceof kind ? [one] : []));
}

/**
 * Returns the nearest element around an event's target that matches a selector; null: there is none.
 *
 * @param {Event} event
 * @param {string} selector
 */
export function around(event, selector) {
  const found = event.target instanceof Element ? event.target.closest(selector) : null;
  return found instanceof HTMLElement ? found : null;
}

/**
 * Makes a text of this kind that a person can close.
 *
 * @param {string} kind
 * @param {string} text
 */
export function makeNotice(kind, text) {
  const made = make("p", kind, text);
  const seen = makeButton("✕", () => made.remove());
  seen.setAttribute("aria-label", "Seen");
  made.append(seen);
  return made;
}

/**
 * Offers these words after the first ones of a list, which are kept; returns whether they changed.
 *
 * @param {HTMLElement} list
 * @param {string[]} words
 * @param {number} [kept]
 */
export function offer(list, words, kept = 0) {
  const options = queryAll(list, "option", HTMLOptionElement).slice(kept);
  if (options.map((option) => option.value).join("\n") === words.join("\n")) return false;
  for (const option of options) option.remove();
  for (const word of words) list.append(new Option(word, word));
  return true;
}

/** @type {Record<string, number | undefined>} */
const STEPS = { ArrowLeft: -1, ArrowRight: 1 };

/**
 * Returns the item to which an arrow key leads, also around the ends; null: another key, or no item is chosen.
 *
 * @template T
 * @param {string} key
 * @param {T[]} all
 * @param {T} chosen
 */
export function stepped(key, all, chosen) {
  const step = STEPS[key],
    at = all.indexOf(chosen);
  return step === undefined || at < 0 ? null : all[(at + step + all.length) % all.length];
}

/**
 * Redraws the content of `root`; the focus stays on the element with the same `data-key`.
 *
 * @param {HTMLElement} root
 * @param {() => void} draw
 */
export function keepingFocus(root, draw) {
  const active = document.activeElement;
  const key = active !== null && root.contains(active) ? active.getAttribute("data-key") : null;
  draw();
  if (key) query(root, `[data-key="${CSS.escape(key)}"]`, HTMLElement)?.focus();
}

/**
 * Keeps the height of an element in a variable of the page's styles.
 *
 * @param {HTMLElement} element
 * @param {string} variable
 */
export function followHeight(element, variable) {
  const told = () => document.documentElement.style.setProperty(variable, `${element.offsetHeight}px`);
  new ResizeObserver(told).observe(element);
}
