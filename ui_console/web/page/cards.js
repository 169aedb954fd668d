// One card for each robot: its newest picture, who has it, and what can be done about it. One of them is large.

import { actWhenHeld } from "./holding.js";
import { Screen } from "./pictures.js";
import { lasting, set } from "./text.js";

const LOOK_EVERY_MS = 250;
const HOLD = "hold to lift"; // what the model says of a stop that nobody else has a say in; the button says it
const MOST_WATCHED = 16; // what the server takes

/** Shows all robots, one of them on the stage; `act(what, robot, more)` does what a person wants. */
export class Cards {
  constructor({ stage, thumbs, say, act }) {
    Object.assign(this, { stage, thumbs, say, act });
    this.cards = new Map();
    this.chosen = "";
    this.large = "";
    setInterval(() => { for (const card of this.cards.values()) card.look(performance.now()); }, LOOK_EVERY_MS);
  }

  /** Show these robots; a card that was there stays, with its picture. */
  show(robots, own, drawn) {
    const names = robots.map((robot) => robot.robot);
    const gone = [...this.cards.keys()].filter((name) => !names.includes(name));
    const isNew = gone.length > 0 || names.some((name) => !this.cards.has(name));
    for (const name of gone) { this.cards.get(name).root.remove(); this.cards.delete(name); }
    for (const robot of robots) {
      if (!this.cards.has(robot.robot)) this.add(robot.robot);
      this.cards.get(robot.robot).fill(robot, own, drawn[robot.robot]);
    }
    this.enlarge(names.includes(own.robot) ? own.robot : names.includes(this.chosen) ? this.chosen : (names[0] ?? ""));
    if (isNew) this.watch();
  }

  add(name) {
    const act = (what, robot, more) => {
      if (what === "enlarge") { this.chosen = name; this.enlarge(name); } else this.act(what, robot, more);
    };
    const card = new Card({ name, act, drawn: (number) => this.say({ do: "drawn", robot: name, number }) });
    this.cards.set(name, card);
    this.thumbs.append(card.root);
  }

  /** Show this one large; who was about to press something on a card still is. */
  enlarge(name) {
    if (name === this.large && this.stage.firstElementChild?.dataset.robot === name) return;
    this.large = name;
    const focus = document.activeElement;
    for (const one of [...this.cards.keys()].sort()) {
      const { root } = this.cards.get(one);
      root.classList.toggle("is-large", one === name);
      (one === name ? this.stage : this.thumbs).append(root);
    }
    if (focus?.closest(".robot")) focus.focus({ preventScroll: true });
  }

  watch() {
    this.say({ do: "watch", robots: [...this.cards.keys()].slice(0, MOST_WATCHED) });
  }

  saw(picture) { this.cards.get(picture.robot)?.screen.saw(picture); }

  /** The robot whose card has the focus, else the large one. */
  get meant() {
    return document.activeElement?.closest?.(".robot")?.dataset.robot ?? this.large;
  }

  /** What is held down on a card counts no more. */
  letGo() { for (const card of this.cards.values()) card.dropLift(); }

  /** The connection ended: who has which robot is not known here. */
  cut() {
    for (const card of this.cards.values()) {
      card.root.classList.remove("is-mine");
      set(card.state, "not known");
      set(card.holder, "");
    }
  }
}

class Card {
  constructor({ name, act, drawn }) {
    Object.assign(this, { name, act });
    this.stop = null;
    this.root = make("article", "robot");
    this.root.dataset.robot = name;
    this.root.setAttribute("aria-label", `robot ${name}`);
    this.screen = new Screen({ name, drawn });
    this.screen.root.append(this.makeEnlarge(), this.makeStanding());
    const top = make("div", "top");
    const title = make("h2", "", name);
    this.state = make("span", "state");
    top.append(title, this.state);
    this.holder = make("p", "holder");
    this.root.append(this.screen.root, top, this.holder, this.makeButtons());
  }

  makeEnlarge() {
    const button = this.button("", "enlarge");
    button.className = "enlarge";
    button.setAttribute("aria-label", `Show ${this.name} large`);
    return button;
  }

  /** What stands over the picture of a stopped robot: whose stop it is, and far from every Stop what lifts it. */
  makeStanding() {
    this.standing = make("div", "standing");
    this.standing.hidden = true;
    this.whose = make("p", "whose");
    this.lift = make("button", "lift", "Hold to lift");
    this.lift.type = "button";
    this.needs = make("p", "needs");
    this.dropLift = actWhenHeld(this.lift, () => { if (this.stop) this.act("lift", this.name, { number: this.stop.number }); });
    this.standing.append(this.whose, this.lift, this.needs);
    return this.standing;
  }

  makeButtons() {
    const row = make("div", "row");
    this.take = this.button("Take over", "take");
    const stop = this.button("Stop", "stop_robot");
    stop.className = "emergency";
    stop.setAttribute("aria-label", `Stop ${this.name}`);
    const why = this.button("Why?", "why");
    why.setAttribute("aria-label", `Why is ${this.name} as it is?`);
    row.append(this.take, stop, why);
    return row;
  }

  button(label, what) {
    const made = make("button", "", label);
    made.type = "button";
    made.addEventListener("click", () => this.act(what, this.name));
    return made;
  }

  fill(robot, own, latency_s) {
    this.screen.latencyMs = 1000 * (latency_s ?? 0);
    this.root.classList.toggle("is-mine", robot.is_mine);
    this.fillStop(robot.stop);
    const isStopped = robot.stop !== null;
    set(this.state, !robot.is_up ? "down" : isStopped ? "STOPPED" : robot.is_mine ? "yours" : robot.holder ? "held" : "free");
    const next = robot.waiting.length ? `; next: ${robot.waiting[0].who}` : "";
    const who = robot.is_mine ? "you" : robot.holder;
    set(this.holder, who ? `${who}: ${robot.feedback || robot.because}${next}` : robot.feedback + next);
    const isWanted = own.is_asked && own.robot === this.name;
    set(this.take, robot.is_mine ? "Yours" : isWanted ? "Waiting…" : "Take over");
    this.take.disabled = robot.is_mine || isWanted;
  }

  fillStop(stop) {
    if (stop?.number !== this.stop?.number) this.dropLift(); // what is held was meant for another stop
    this.stop = stop;
    this.root.classList.toggle("is-stopped", stop !== null);
    this.standing.hidden = stop === null;
    if (stop === null) return;
    const whom = stop.is_mine ? "you" : stop.by_user || stop.by;
    const unsure = stop.is_confirmed ? "" : "; the wheels may turn for a moment more";
    set(this.whose, `STOPPED by ${whom}${lasting(stop.age_s)}${stop.reason ? `: ${stop.reason}` : ""}${unsure}`);
    set(this.needs, stop.lift_line === HOLD ? "" : stop.lift_line);
    this.lift.setAttribute("aria-label", `Hold to lift the stop of ${this.name} by ${whom}`);
  }

  look(now) { this.root.classList.toggle("is-stale", this.screen.look(now)); }
}

function make(tag, className, text = "") {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}
