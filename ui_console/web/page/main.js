// The page: joins the connection, the cards, the hands and the tables.

import { Blindness } from "./blind.js";
import { Cards } from "./cards.js";
import { Driving } from "./driving.js";
import { Hand } from "./hand.js";
import { Keys } from "./keys.js";
import { Link } from "./link.js";
import { Login } from "./login.js";
import { notice, read, showAlarm, showHealth } from "./notices.js";
import { Stopping } from "./stopping.js";
import { Tables } from "./tables.js";
import { seconds, set } from "./text.js";
import { followTheme } from "./theme.js";

const TOUCHED_EVERY_MS = 5000; // chosen: far below the two minutes after which nobody is thought to be here
const find = (id) => document.getElementById(id);
const view = {};

const link = new Link({ heard, saw: (picture) => cards.saw(picture), changed });
const say = (message) => link.say(message);
const cards = new Cards({ stage: find("stage"), thumbs: find("thumbs"), say, act });
const tables = new Tables({ tabs: find("tabs"), panel: find("panel"), act });
const stopping = new Stopping({ say, shown: find("unsure") });
const driving = new Driving({
  pad: find("pad"), knob: find("knob"), hint: find("let-go"), say,
  does: (what) => act(what, what === "take" ? cards.meant : ""),
  isClogged: () => link.isClogged,
  speed: () => hand.speed,
});
const hand = new Hand({ act, driving });
const blindness = new Blindness({
  link, root: find("blind"), title: find("blind-title"), why: find("blind-why"),
  areas: [find("alarm-bar"), find("stage"), find("side")],
  stops: () => document.querySelectorAll("button.emergency"),
});
new Keys({
  isHeld: () => hand.held !== "",
  does: (what, code) => (what === "drive" ? driving.press(code) : act(what, "")),
});
followTheme(find("theme"));

// ---------------------------------------------------------------- coming in
const login = new Login({ form: find("login"), enter: (hello) => link.open(hello) });

function changed({ is, why, ageMs }) {
  set(find("link"), is === "fresh" ? "connected" : is === "old" ? `NOT HEARD: ${why}` : `NOT CONNECTED: ${why}`);
  find("link").classList.toggle("is-down", is !== "fresh");
  driving.letGo();
  cards.letGo();
  if (link.isUp) find("console").hidden = false;
  else { hand.cut(why, ageMs); cards.cut(); }
  if (is === "fresh") cards.watch();
  if (is === "refused") { find("console").hidden = true; login.ask(why); }
  blindness.look();
}

// ---------------------------------------------------------------- what is heard
function heard(message) {
  if (message.answer) { answered(message.answer); return; }
  Object.assign(view, message.view);
  const changes = message.view;
  if (changes.welcome) {
    const { mission, user, priority } = view.welcome;
    find("mission").textContent = `${mission} · ${user}, priority ${priority}`;
    document.title = `${mission} – Scout console`;
  }
  if (changes.now_s !== undefined) set(find("clock"), seconds(view.now_s));
  if (changes.own) {
    hand.show(view.own, view.now_s ?? 0);
    const down_s = view.own.link_down_s ?? -1;
    blindness.hub(down_s < 0 ? -1 : 1000 * Math.max(0, (view.now_s ?? down_s) - down_s));
  }
  if (changes.robots) stopping.heard(view.robots);
  if (changes.robots || changes.own) {
    cards.show(view.robots ?? [], view.own ?? {}, view.drawn ?? {});
    nameStop();
  }
  if (changes.health !== undefined) showHealth(view.health);
  if (changes.alarms) showAlarm(view.alarms, act);
  tables.show(view, changes);
}

function answered(answer) {
  if (answer.why !== undefined) read(`Why ${answer.why}?`, answer.lines);
  else if (answer.refused) notice(answer.refused);
  else if (answer.told === false || answer.done === false) notice("It did not answer so; the alarms say what it said.");
}

// ---------------------------------------------------------------- what is wanted
const words = {
  take: (name) => ({ do: "take", robot: name }),
  release: () => ({ do: "release" }),
  lift: (name, more) => ({ do: "lift", robot: name, ...more }),
  may_i: () => ({ do: "may_i" }),
  consent: (isGiven) => ({ do: "decide", is_given: isGiven }),
  dismiss: () => ({ do: "dismiss_lost" }),
  jump: () => ({ do: "jump" }),
  why: (name) => ({ do: "why", name }),
  acknowledge: (key) => ({ do: "acknowledge", key }),
  parameters: (name) => ({ do: "parameters", name }),
  set: (name, more) => ({ do: "set", name, ...more }),
};
const LET_GO = ["take", "release", "lift", "consent"]; // what is held down was not meant for what comes of these

function act(what, name, more = {}) {
  switch (what) {
    case "halt": driving.letGo(true); return;
    case "stop_robot": driving.letGo(); stopping.one(name); return;
    case "stop_mine": driving.letGo(); stopMine(meant()); return;
    case "stop_all": driving.letGo(); stopping.all(); return;
    case "faster": hand.change(1); return;
    case "slower": hand.change(-1); return;
  }
  if (LET_GO.includes(what)) driving.letGo();
  if (!say(words[what](name, more))) notice(`NOT CONNECTED: ${what.replace("_", " ")} was not sent.`);
}

function meant() { return hand.held || cards.meant; }

/** A dialog covers every red button but its own. */
function nameStop() { set(find("reading-stop"), `Stop ${meant()}`); }

function stopMine(name) {
  if (name) stopping.one(name);
  else notice("There is no robot to stop.");
}

for (const id of ["stop-all", "reading-stop-all"]) find(id).addEventListener("click", () => act("stop_all", ""));
find("reading-stop").addEventListener("click", () => act("stop_mine", ""));
for (const dialog of document.querySelectorAll("dialog")) {
  new MutationObserver(() => { driving.letGo(); nameStop(); }).observe(dialog, { attributeFilter: ["open"] });
}
document.addEventListener("visibilitychange", () => say({ do: "here", is_there: !document.hidden }));
let touchedAt = 0;
addEventListener("pointerdown", () => {
  if (performance.now() - touchedAt < TOUCHED_EVERY_MS) return;
  touchedAt = performance.now();
  say({ do: "here", is_there: true });
}, true);

login.begin();
