// What the designer's page says in passing: how the draft is, who else is here, and notices.

const NOTICES = 3;
const find = (id) => document.getElementById(id);

/** Show how the draft is, and which commands it allows. */
export function showStatus(status) {
  const name = status.source.split("/").at(-1);
  const count = status.problems ? `${status.problems} problem${status.problems === 1 ? "" : "s"}` : "fine";
  find("mission").textContent = name;
  find("state").textContent = `${status.is_changed ? "changed" : "saved"}, ${count}`;
  find("state").className = status.problems ? "failure" : status.is_changed ? "warning" : "success";
  document.title = `${status.is_changed ? "● " : ""}${name} – Mission design`;
  find("undo").disabled = !status.can_undo;
  find("redo").disabled = !status.can_redo;
  find("revert").disabled = !status.is_changed || status.is_new;
  find("save").disabled = !status.is_changed;
}

/** Show who else works on the draft. */
export function showPeople(people, user) {
  const others = people.filter((_one, at) => at !== people.indexOf(user));
  find("people").textContent = people.length > 1 ? `with ${others.join(", ")}` : "";
}

/** Say something that a person has seen when they say so, or when newer ones need its place. */
export function notice(text, remedy, kind = "bad") {
  const made = document.createElement("p"),
    seen = document.createElement("button");
  made.className = kind;
  made.textContent = remedy ? `${text} (${remedy})` : text;
  seen.type = "button";
  seen.textContent = "✕";
  seen.setAttribute("aria-label", "Seen");
  seen.addEventListener("click", () => made.remove());
  made.append(seen);
  const root = find("notices");
  root.append(made);
  while (root.children.length > NOTICES) root.firstChild.remove();
}
