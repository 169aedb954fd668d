// The page: connects the socket, the cards, the controls and the tables.

import { Blindness } from "./blind.js";
import { BusKeys } from "./bus.js";
import { Cards } from "./cards.js";
import { Commands } from "./commands.js";
import { find, followHeight, queryAll } from "./dom.js";
import { Confirmations } from "./drawn.js";
import { Driving } from "./driving.js";
import { Hand } from "./hand.js";
import { Keys } from "./keys.js";
import { fits, Link } from "./link.js";
import { Log } from "./log.js";
import { Login } from "./login.js";
import { RobotMap } from "./map.js";
import { showMissions } from "./missions.js";
import { notice, read, showAlarm, showHealth } from "./notices.js";
import { Orders } from "./orders.js";
import { Playback } from "./playback.js";
import { Seen } from "./seen.js";
import { Stopping } from "./stopping.js";
import { Tables } from "./tables.js";
import { seconds, set } from "./text.js";
import { followTheme } from "./theme.js";

/** @import { Answer, Heard, OrderKind, Said, View } from "./messages.d.ts" */
/** @import { Act, LinkChange, More, Picture, Say, Tap } from "./types.d.ts" */

const TOUCHED_EVERY_MS = 5000; // chosen: far below the two minutes after which the operator counts as away
/** @type {Partial<View>} */
const view = {};

/** @type {Link<Heard, Said>} */
const link = new Link({ heard, saw, changed });
const confirmations = new Confirmations((message) => link.say(message));
/** @type {Say} */
const say = (message) => (message.do === "drawn" ? confirmations.add(message) : link.say(message));
const cards = new Cards({ stage: find("stage"), thumbs: find("thumbs"), say, act });
const seen = new Seen({
  panel: find("seen-panel", HTMLDetailsElement),
  behavior: find("seen-behavior", HTMLSelectElement),
  view: find("seen-view", HTMLSelectElement),
  told: find("seen-told"),
  values: find("seen-values"),
  place: find("seen-place"),
  say,
});
const bus = new BusKeys({
  panel: find("bus-panel", HTMLDetailsElement),
  list: find("bus-list"),
  words: find("bus-words", HTMLInputElement),
  order: find("bus-order", HTMLSelectElement),
  told: find("bus-told"),
  keys: find("bus-keys"),
  view: find("bus-view"),
  back: find("bus-back"),
  title: find("bus-title"),
  head: find("bus-head"),
  fields: find("bus-fields"),
  plots: find("bus-plots"),
  place: find("bus-place"),
  say,
});
const log = new Log({
  form: find("log-search", HTMLFormElement),
  status: find("log-status"),
  exporting: find("log-export"),
  say,
  redraw: () => tables.draw(),
});
const tables = new Tables({ tabs: find("tabs"), panel: find("panel"), act, log });
const stopping = new Stopping({ say, shown: find("unsure") });
const driving = new Driving({
  pad: find("pad"),
  knob: find("knob"),
  hint: find("let-go"),
  say,
  does: (what) => act(what, what === "take" ? cards.meant : ""),
  isClogged: () => link.isClogged,
  speed: () => hand.speed,
  moment: () => hand.moment,
});
const commands = new Commands({
  root: find("commands", HTMLFieldSetElement),
  give: (word, values, role) => act("give", word, { values, role }),
});
const hand = new Hand({ act, driving, commands });
const map = new RobotMap({ act, inHand: () => hand.stick });
const playback = new Playback({ say, act });
const orders = new Orders({ list: find("orders"), act });
const blindness = new Blindness({
  link,
  root: find("blind"),
  title: find("blind-title"),
  why: find("blind-why"),
  areas: [find("alarm-bar"), find("stage"), find("side"), find("map")],
  stops: () => queryAll(document, "button.emergency", HTMLButtonElement),
  isLive: () => playback.now === null,
});
new Keys({
  isHeld: () => hand.stick !== "",
  isCut: () => !link.isUp,
  does: (what, code) => (what === "drive" ? driving.press(code) : act(what, "")),
});
followTheme(find("theme", HTMLSelectElement));
followHeight(find("header"), "--header");
followHeight(find("hand"), "--hand");

// ---------------------------------------------------------------- login
const login = new Login({ form: find("login", HTMLFormElement), enter: (hello) => link.open(hello) });

/** @param {LinkChange} to */
function changed({ is, why, ageMs }) {
  set(find("link"), is === "fresh" ? "connected" : is === "old" ? `NOT HEARD: ${why}` : `NOT CONNECTED: ${why}`);
  find("link").classList.toggle("is-down", is !== "fresh");
  driving.letGo();
  cards.letGo();
  if (link.isUp) find("console").hidden = false;
  else {
    hand.cut(why, ageMs);
    cards.cut();
    log.cut();
  }
  if (is === "fresh") {
    cards.watch();
    seen.again();
    bus.again();
  }
  if (is === "refused") {
    find("console").hidden = true;
    login.ask(why);
  }
  blindness.look();
}

// ---------------------------------------------------------------- messages of the server
/** @param {Picture} picture Of a robot; of a view, whose names have a slash; of the bus, whose names begin with one. */
function saw(picture) {
  if (picture.robot.startsWith("/")) bus.saw(picture);
  else if (picture.robot.includes("/")) seen.saw(picture);
  else cards.saw(picture);
}

/** @param {Heard} message */
function heard(message) {
  if (message.answer) {
    answered(message.answer);
    return;
  }
  const changes = message.view;
  Object.assign(view, changes);
  if (changes.welcome) {
    const { mission, user, priority } = changes.welcome;
    showMissions(changes.welcome);
    find("mission").textContent = `${mission} · ${user}, priority ${priority}`;
    document.title = `${mission} – Scout console`;
  }
  if (changes.now_s !== undefined) set(find("clock"), seconds(changes.now_s));
  if (changes.abilities !== undefined) hand.know(changes.abilities);
  if (changes.own) {
    hand.show(changes.own, view.now_s ?? 0);
    orders.show(changes.own.orders);
    const down_s = changes.own.link_down_s;
    blindness.hub(down_s < 0 ? -1 : 1000 * Math.max(0, (view.now_s ?? down_s) - down_s));
  }
  if (changes.floor !== undefined || changes.bodies || changes.own) map.show(view, changes);
  if (changes.robots) stopping.heard(changes.robots);
  if (changes.robots || changes.own) {
    cards.show(view.robots ?? [], view.own ?? {}, view.drawn ?? {});
    nameStop();
  }
  if (changes.health !== undefined) showHealth(changes.health);
  if (changes.components) seen.know(changes.components);
  if (changes.seen) seen.heard(changes.seen);
  if (changes.playback) playback.show(changes.playback);
  if (changes.markers) playback.mark(changes.markers);
  if (changes.alarms) showAlarm(changes.alarms, act);
  if (changes.welcome || changes.robots || changes.log) log.know(view);
  tables.show(view, changes);
}

/** @param {Answer} answer */
function answered(answer) {
  if ("why" in answer) read(`Why ${answer.why}?`, answer.lines);
  else if ("log" in answer) log.heard(answer.log);
  else if ("refused" in answer) notice(answer.refused);
  else if ("told" in answer ? !answer.told : !answer.done) notice("It did not answer so; the alarms say what it said.");
}

// ---------------------------------------------------------------- the operator's actions
/** @type {Record<string, (name: string, more: More) => Said>} */
const words = {
  take: (name, { kind = "" }) => ({ do: "take", robot: name, kind }),
  release: () => ({ do: "release" }),
  lift: (name, { number = 0 }) => ({ do: "lift", robot: name, number }),
  may_i: () => ({ do: "may_i" }),
  consent: (answer, { number = 0 }) => ({ do: "decide", is_given: answer === "yes", number }),
  dismiss: () => ({ do: "dismiss_lost" }),
  give: (word, { values = {}, role = "" }) => ({ do: "give", moment: hand.moment, word, values, role }),
  order: (kind, { robots = [], x_m = 0, y_m = 0, target = "" }) => ({
    do: "order",
    moment: hand.moment,
    kind: /** @type {OrderKind} */ (kind),
    robots,
    x_m,
    y_m,
    target,
  }),
  end_orders: (_name, { robots = [] }) => ({ do: "end_orders", robots }),
  why: (name) => ({ do: "why", name }),
  acknowledge: (key) => ({ do: "acknowledge", key }),
  parameters: (name) => ({ do: "parameters", name }),
  set: (name, { parameter = "", value }) => ({ do: "set", name, parameter, value }),
};
const LET_GO = ["take", "release", "lift", "consent", "order"]; // a held control must not act after these

/** @type {Act} */
function act(what, name = "", more = {}) {
  switch (what) {
    case "halt":
      driving.letGo(true);
      if (!hand.held && hand.ordered) act("end_orders", "", { robots: [hand.ordered] });
      return;
    case "order_in_picture":
      if (more.tap) goInPicture(name, more.tap);
      return;
    case "stop_robot":
      driving.letGo();
      stopping.one(name);
      return;
    case "stop_mine":
      driving.letGo();
      stopMine(meant());
      return;
    case "stop_all":
      driving.letGo();
      stopping.all();
      return;
    case "jump":
      if (!commands.giveByWord("jump")) notice("This robot cannot jump.");
      return;
    case "faster":
      hand.change(1);
      return;
    case "slower":
      hand.change(-1);
      return;
  }
  if (LET_GO.includes(what)) driving.letGo();
  const message = words[what](name, more);
  const unsent = `${what.replace("_", " ")} was not sent.`;
  if (!fits(message)) notice(`TOO LONG: ${unsent}`);
  else if (!say(message)) notice(`NOT CONNECTED: ${unsent}`);
}

/** The robot that a single stop concerns. */
function meant() {
  return hand.stick || cards.meant;
}

/**
 * Send the selected robots to the place on the floor at a point of a robot's picture.
 *
 * @param {string} robot
 * @param {Tap} tap
 */
function goInPicture(robot, tap) {
  const robots = map.meant;
  driving.letGo();
  if (robots.length === 0) notice(`To send a robot there, take ${robot} over or select robots on the map.`);
  else if (!say({ do: "order_in_picture", moment: hand.moment, robot, robots, ...tap })) {
    notice("NOT CONNECTED: the order was not sent.");
  }
}

/** An open dialog covers all red buttons except its own. */
function nameStop() {
  set(find("reading-stop"), `Stop ${meant()}`);
}

/** @param {string} name */
function stopMine(name) {
  if (name) stopping.one(name);
  else notice("There is no robot to stop.");
}

for (const id of ["stop-all", "reading-stop-all"]) find(id).addEventListener("click", () => act("stop_all", ""));
find("reading-stop").addEventListener("click", () => act("stop_mine", ""));
for (const dialog of document.querySelectorAll("dialog")) {
  new MutationObserver(() => {
    driving.letGo();
    nameStop();
  }).observe(dialog, { attributeFilter: ["open"] });
}
document.addEventListener("visibilitychange", () => say({ do: "here", is_there: !document.hidden }));
let touchedAt = -TOUCHED_EVERY_MS;
function touched() {
  if (performance.now() - touchedAt < TOUCHED_EVERY_MS) return;
  touchedAt = performance.now();
  say({ do: "here", is_there: true });
}
for (const touch of ["pointerdown", "keydown"]) addEventListener(touch, touched, true);

login.begin();
