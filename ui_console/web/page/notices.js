// Notices: newest alarm, refusals, and longer answers to read.

import { find, make, makeButton, makeNotice } from "./dom.js";
import { set } from "./text.js";

/** @import { AlarmView, HealthView } from "./messages.d.ts" */
/** @import { Act } from "./types.d.ts" */

const SHOWN_MS = 12000; // chosen: long enough to be read twice

/**
 * Show the first unacknowledged alarm.
 *
 * @param {AlarmView[]} alarms
 * @param {Act} act
 */
export function showAlarm(alarms, act) {
  const bar = find("alarm-bar");
  const first = alarms.find((alarm) => !alarm.acknowledged_by);
  const shown = first ? `${first.key} ${first.line} ${first.remedy} ${first.count}` : "none";
  if (bar.dataset.shown === shown) return;
  bar.dataset.shown = shown;
  bar.className = first?.severity ?? "quiet";
  if (!first) {
    bar.replaceChildren("no alarm");
    return;
  } // keeps its place, so that nothing moves under a finger
  const line = make("span");
  line.textContent = `${first.severity}: ${first.line}${first.remedy ? ` — ${first.remedy}` : ""}`;
  const why = makeButton("Why?", () => act("why", first.subject), "", first.subject);
  bar.replaceChildren(
    line,
    why,
    makeButton("Seen", () => act("acknowledge", first.key), "", first.line),
  );
}

/** @param {HealthView | null} health */
export function showHealth(health) {
  const shown = find("health");
  shown.hidden = health === null;
  if (health === null) return;
  shown.className = health.word;
  shown.title = health.lines.join("\n");
  set(shown, `mission ${[health.word, ...health.lines.slice(0, 1)].join(": ")}`);
}

/**
 * Show a notice that covers no button, above all not Stop.
 *
 * @param {string} text
 */
export function notice(text) {
  const line = makeNotice("", text);
  find("notices").append(line);
  setTimeout(() => line.remove(), SHOWN_MS);
}

/**
 * @param {string} title
 * @param {string[]} lines
 */
export function read(title, lines) {
  find("reading-title").textContent = title;
  find("reading-lines").replaceChildren(...lines.map((line) => make("li", "", line)));
  if (!find("reading", HTMLDialogElement).open) find("reading", HTMLDialogElement).showModal();
}
