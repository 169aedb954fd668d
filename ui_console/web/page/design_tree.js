// The tree of the mission: rows, one of them chosen, folded or not, gone through by keys.

const FOLDED_AT_FIRST = ["core", "types"]; // what is the same in most missions, and filled by what is added elsewhere

export const keyOf = (path) => path.join("/");
export const pathOf = (key) => (key ? key.split("/").map(Number) : []);
export const isWithin = (path, above) =>
  above.every((number, depth) => path[depth] === number) && path.length >= above.length;

/** What is folded stays so wherever it is moved. */
const nameOf = (row) => `${row.path.length} ${row.tag} ${row.told}`;

/** Shows `rows` ({path, tag, told, problems}); `choose(path, isTouched)` is called when one is chosen by hand, or by a key. */
export class Tree {
  constructor({ root, choose, key }) {
    Object.assign(this, { root, choose, key });
    this.rows = [];
    this.byKey = new Map();
    this.inside = new Map();
    this.at = [];
    this.unfolded = new Set();
    this.folded = new Set();
    this.focuses = false;
    root.addEventListener("click", (event) => {
      const row = event.target.closest(".element");
      if (!row) return;
      if (event.target.closest(".fold")) this.fold(pathOf(row.dataset.key));
      this.pick(pathOf(row.dataset.key), true);
    });
    root.addEventListener("keydown", (event) => this.pressed(event));
  }

  row(path) {
    return this.byKey.get(keyOf(path));
  }
  parts(path) {
    return this.inside.get(keyOf(path)) ?? [];
  }
  node(path) {
    return this.root.querySelector(`[data-key="${keyOf(path)}"]`);
  }

  isFolded(row) {
    if (this.parts(row.path).length === 0) return false;
    if (row.path.length === 1 && FOLDED_AT_FIRST.includes(row.tag)) return !this.unfolded.has(row.tag);
    return this.folded.has(nameOf(row));
  }

  fold(path, isFolded = null) {
    const row = this.row(path);
    if (!row || path.length === 0) return;
    const folds = isFolded ?? !this.isFolded(row);
    if (row.path.length === 1 && FOLDED_AT_FIRST.includes(row.tag)) this.unfolded[folds ? "delete" : "add"](row.tag);
    else this.folded[folds ? "add" : "delete"](nameOf(row));
    this.draw();
  }

  show(rows) {
    this.rows = rows;
    this.byKey = new Map(rows.map((row) => [keyOf(row.path), row]));
    this.inside = new Map();
    for (const row of rows) {
      if (row.path.length === 0) continue;
      const above = keyOf(row.path.slice(0, -1));
      if (this.inside.has(above)) this.inside.get(above).push(row);
      else this.inside.set(above, [row]);
    }
    this.draw();
  }

  /** Mark the element that the server says is chosen. */
  mark(path) {
    const isOther = keyOf(path) !== keyOf(this.at);
    this.at = path;
    for (let depth = 1; depth < path.length; depth += 1) {
      const above = this.row(path.slice(0, depth));
      if (above && this.isFolded(above)) this.fold(above.path, false);
    }
    this.draw();
    if (isOther) this.node(path)?.scrollIntoView({ block: "nearest" });
  }

  pick(path, isTouched = false) {
    this.at = path;
    this.draw();
    this.node(path)?.focus({ preventScroll: true });
    this.node(path)?.scrollIntoView({ block: "nearest" });
    this.choose(path, isTouched);
  }

  draw() {
    const hasFocus = this.root.contains(document.activeElement);
    const shown = [];
    let folded = null;
    for (const row of this.rows) {
      // in the order of the text, so what is in a folded one follows it
      if (folded !== null && isWithin(row.path, folded)) continue;
      shown.push(row);
      folded = this.isFolded(row) ? row.path : null;
    }
    const made = shown.map((row) => this.made(row));
    this.root.replaceChildren(...made);
    const chosen = this.node(this.at) ?? made[0];
    if (chosen) {
      chosen.tabIndex = 0;
      if (hasFocus) chosen.focus({ preventScroll: true });
    }
  }

  made(row) {
    const made = document.createElement("div"),
      isFolded = this.isFolded(row);
    const inside = row.path.length ? this.parts(row.path).length : 0; // the mission itself is never folded
    made.className = `element tag-${row.tag}`;
    made.dataset.key = keyOf(row.path);
    made.dataset.told = `${row.tag} ${row.told}`.trim();
    if (row.path.length) made.dataset.drag = "element";
    made.tabIndex = -1;
    made.setAttribute("role", "treeitem");
    made.setAttribute("aria-label", [made.dataset.told, ...row.problems.map((one) => `problem: ${one}`)].join("; "));
    made.setAttribute("aria-level", String(row.path.length + 1));
    made.setAttribute("aria-selected", String(keyOf(row.path) === keyOf(this.at)));
    if (inside) made.setAttribute("aria-expanded", String(!isFolded));
    made.style.setProperty("--depth", String(row.path.length));
    made.append(part("handle", row.path.length > 1 ? "⠿" : "", "true"));
    made.append(part("fold", inside ? (isFolded ? "▸" : "▾") : "", "true"));
    if (row.problems.length) {
      const cross = part("wrong", "✗");
      cross.title = row.problems.join("\n");
      cross.setAttribute("aria-hidden", "true");
      made.append(cross);
    }
    made.append(part("tag", row.tag), part("told", isFolded ? `… ${inside}` : row.told));
    return made;
  }

  pressed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const keys = [...this.root.children].map((one) => one.dataset.key);
    const number = keys.indexOf(keyOf(this.at));
    const to = (next) => {
      if (next >= 0 && next < keys.length) this.pick(pathOf(keys[next]));
    };
    const row = this.row(this.at);
    if (!row) return;
    const moves = {
      ArrowDown: () => to(number + 1),
      ArrowUp: () => to(number - 1),
      Home: () => to(0),
      End: () => to(keys.length - 1),
      ArrowRight: () =>
        this.isFolded(row) ? this.fold(row.path, false) : this.parts(row.path).length && to(number + 1),
      ArrowLeft: () => {
        if (!this.isFolded(row) && this.parts(row.path).length && row.path.length) this.fold(row.path, true);
        else if (row.path.length) this.pick(row.path.slice(0, -1));
      },
      " ": () => this.fold(row.path),
    };
    const move = event.shiftKey ? null : moves[event.key];
    if (move) move();
    else if (!this.key(event)) return;
    event.preventDefault();
  }
}

function part(className, text, isHidden = "") {
  const made = document.createElement("span");
  made.className = className;
  made.textContent = text;
  if (isHidden) made.setAttribute("aria-hidden", isHidden);
  return made;
}
