// What a person is told in passing: newest alarm, refusals, and longer answers to read.

import { set } from "./text.js";

const find = (id) => document.getElementById(id);
const SHOWN_MS = 12000; // chosen: long enough to be read twice

/** Show the first alarm that nobody has seen. */
export function showAlarm(alarms, act) {
  const bar = find("alarm-bar");
  const first = alarms.find((alarm) => !alarm.acknowledged_by);
  const shown = first ? `${first.key} ${first.line} ${first.remedy} ${first.count}` : "none";
  if (bar.dataset.shown === shown) return;
  bar.dataset.shown = shown;
  bar.className = first?.severity ?? "quiet";
  if (!first) { bar.replaceChildren("no alarm"); return; } // its place is kept: nothing moves under a finger
  const line = document.createElement("span");
  line.textContent = `${first.severity}: ${first.line}${first.remedy ? ` — ${first.remedy}` : ""}`;
  const why = button("Why?", () => act("why", first.subject));
  bar.replaceChildren(line, why, button("Seen", () => act("acknowledge", first.key)));
}

export function showHealth(health) {
  const shown = find("health");
  shown.hidden = health === null;
  if (health === null) return;
  shown.className = health.word;
  shown.title = health.lines.join("\n");
  set(shown, `mission ${[health.word, ...health.lines.slice(0, 1)].join(": ")}`);
}

/** Say it without standing in the way of anything, least of all of Stop. */
export function notice(text) {
  const line = document.createElement("p");
  line.append(text, button("✕", () => line.remove()));
  line.lastChild.setAttribute("aria-label", "Seen");
  find("notices").append(line);
  setTimeout(() => line.remove(), SHOWN_MS);
}

export function read(title, lines) {
  find("reading-title").textContent = title;
  const items = lines.map((line) => Object.assign(document.createElement("li"), { textContent: line }));
  find("reading-lines").replaceChildren(...items);
  if (!find("reading").open) find("reading").showModal();
}

function button(label, press) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = label;
  made.addEventListener("click", press);
  return made;
}
