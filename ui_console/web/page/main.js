// The page: joins the connection, the cards, the hands and the tables.

import { Driving } from "./driving.js";
import { Link } from "./link.js";
import { Login } from "./login.js";
import { Cards } from "./pictures.js";
import { Tables, seconds } from "./tables.js";

const find = (id) => document.getElementById(id);
const view = {};

const link = new Link({ heard, saw: (picture) => cards.saw(picture), changed });
const say = (message) => link.say(message);
const cards = new Cards({ root: find("videos"), say, act });
const tables = new Tables({ tabs: find("tabs"), panel: find("panel"), act });
const driving = new Driving({
  pad: find("pad"), knob: find("knob"), say,
  isClogged: () => link.isClogged,
  speed: () => Number(find("speed").value),
});

// ---------------------------------------------------------------- coming in
const login = new Login({ form: find("login"), enter: (hello) => link.open(hello) });

function changed(isUp, why, isRefused = false) {
  const shown = find("link");
  shown.classList.toggle("is-down", !isUp);
  shown.textContent = isUp ? "connected" : `NOT CONNECTED: ${why}`;
  find("stop-all").disabled = !isUp;
  document.body.classList.toggle("is-down", !isUp);
  if (isUp) { find("console").hidden = false; cards.watch(); return; }
  driving.letGo();
  if (isRefused) { find("console").hidden = true; login.ask(why); }
}

// ---------------------------------------------------------------- what is heard
function heard(message) {
  if (message.answer) { answered(message.answer); return; }
  Object.assign(view, message.view);
  const changes = message.view;
  if (changes.welcome) {
    find("mission").textContent = `${view.welcome.mission} · ${view.welcome.user}, priority ${view.welcome.priority}`;
    document.title = `${view.welcome.mission} – Scout console`;
  }
  if (changes.now_s !== undefined) find("clock").textContent = seconds(view.now_s);
  if (changes.own) showOwn(view.own);
  if (changes.robots || changes.own) cards.show(view.robots ?? [], view.own ?? {}, view.drawn ?? {});
  if (changes.health !== undefined) showHealth(view.health);
  if (changes.alarms) showAlarm(view.alarms);
  tables.show(view, changes);
}

function showOwn(own) {
  set(find("own"), own.status);
  set(find("taken"), own.taken_because ? `Taken from you: ${own.taken_because}` : "");
  set(find("applied"), own.applied ? `applied: ${own.applied}` : "");
  const consent = own.consent;
  find("consent").hidden = consent === null;
  if (consent) {
    const others = consent.others ? `, ${consent.others} more ask` : "";
    set(find("consent-line"), `${consent.user} asks for ${consent.robot}: ${consent.why} (${Math.ceil(consent.left_s)} s${others})`);
  }
  set(find("asked"), own.asked);
  find("may-i").disabled = !own.is_asked || own.is_held;
  find("release").disabled = !own.is_asked;
  find("take").disabled = own.is_asked;
  find("jump").disabled = !own.is_held;
  document.body.dataset.held = own.is_held ? own.robot : "";
}

function showHealth(health) {
  const shown = find("health");
  shown.hidden = health === null;
  if (health === null) return;
  shown.className = health.word;
  shown.title = health.lines.join("\n");
  set(shown, `mission ${[health.word, ...health.lines.slice(0, 1)].join(": ")}`);
}

function showAlarm(alarms) {
  const bar = find("alarm-bar");
  const first = alarms.find((alarm) => !alarm.acknowledged_by);
  bar.hidden = first === undefined;
  if (first === undefined || bar.dataset.shown === `${first.key}${first.line}${first.count}`) return;
  bar.dataset.shown = `${first.key}${first.line}${first.count}`;
  bar.className = first.severity;
  const line = document.createElement("span");
  line.textContent = `${first.severity}: ${first.line}${first.remedy ? ` — ${first.remedy}` : ""}`;
  const seen = document.createElement("button");
  seen.type = "button";
  seen.textContent = "Seen";
  seen.addEventListener("click", () => act("acknowledge", first.key));
  bar.replaceChildren(line, seen);
}

function answered(answer) {
  if (answer.why !== undefined) read(`Why ${answer.why}?`, answer.lines);
  else if (answer.refused) read("No", [answer.refused]);
  else if (answer.told === false || answer.done === false) read("It did not answer so", ["See the alarms for what it said."]);
}

function read(title, lines) {
  find("reading-title").textContent = title;
  find("reading-lines").replaceChildren(...lines.map((line) => Object.assign(document.createElement("li"), { textContent: line })));
  if (!find("reading").open) find("reading").showModal();
}

function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// ---------------------------------------------------------------- what is wanted
function act(what, name, more = {}) {
  switch (what) {
    case "take": driving.letGo(); return say({ do: "take", robot: name });
    case "release": driving.letGo(); return say({ do: "release" });
    case "stop_robot": driving.letGo(); return say({ do: "stop_robot", robot: name });
    case "lift": return say({ do: "lift", robot: name, number: view.robots?.find((robot) => robot.robot === name)?.stop?.number ?? 0 });
    case "why": return say({ do: "why", name });
    case "acknowledge": return say({ do: "acknowledge", key: name });
    case "parameters": return say({ do: "parameters", name });
    case "set": return say({ do: "set", name, ...more });
  }
}

find("stop-all").addEventListener("click", () => { driving.letGo(); say({ do: "stop_all" }); });
find("take").addEventListener("click", () => act("take", view.own?.robot ?? ""));
find("release").addEventListener("click", () => act("release"));
find("may-i").addEventListener("click", () => say({ do: "may_i" }));
find("consent-yes").addEventListener("click", () => { driving.letGo(); say({ do: "decide", is_given: true }); });
find("consent-no").addEventListener("click", () => say({ do: "decide", is_given: false }));
find("halt").addEventListener("click", () => driving.letGo(true));
find("jump").addEventListener("click", () => say({ do: "jump" }));
find("speed").addEventListener("input", () => { find("speed-shown").textContent = find("speed").value; });
document.addEventListener("visibilitychange", () => say({ do: "here", is_there: !document.hidden }));
let touchedAt = 0;
addEventListener("pointerdown", () => {
  if (performance.now() - touchedAt < 5000) return;
  touchedAt = performance.now();
  say({ do: "here", is_there: true });
}, true);

login.begin();
