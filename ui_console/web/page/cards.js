// One card for each robot: its newest picture, its holder, and the operator's actions. One card is large.

import { make, makeButton } from "./dom.js";
import { Gauges, lineOf } from "./gauges.js";
import { actWhenHeld } from "./holding.js";
import { ofMission } from "./missions.js";
import { notice } from "./notices.js";
import { Screen } from "./pictures.js";
import { lasting, readingOrder, set } from "./text.js";

/** @import { OwnView, RobotView, StopView } from "./messages.d.ts" */
/** @import { Act, Picture, Say, Tap } from "./types.d.ts" */

const LOOK_EVERY_MS = 250;
const HOLD = "hold to lift"; // the model's line for a stop that only this operator set; the button shows it
const MOST_WATCHED = 16; // the server's limit

/** Shows all robots, one of them on the stage; `act(what, robot, more)` carries out a person's action. */
export class Cards {
  /** @param {{ stage: HTMLElement, thumbs: HTMLElement, say: Say, act: Act }} given */
  constructor({ stage, thumbs, say, act }) {
    this.stage = stage;
    this.thumbs = thumbs;
    this.say = say;
    this.act = act;
    /** @type {Map<string, Card>} */
    this.cards = new Map();
    this.chosen = "";
    this.large = "";
    setInterval(() => {
      for (const card of this.cards.values()) card.look(performance.now());
    }, LOOK_EVERY_MS);
  }

  /**
   * Show these robots; an existing card stays, with its picture.
   *
   * @param {RobotView[]} robots
   * @param {Partial<OwnView>} own
   * @param {Record<string, number>} drawn
   */
  show(robots, own, drawn) {
    const names = robots.map((robot) => robot.robot);
    const gone = [...this.cards.keys()].filter((name) => !names.includes(name));
    const isNew = gone.length > 0 || names.some((name) => !this.cards.has(name));
    for (const name of gone) {
      this.cards.get(name)?.root.remove();
      this.cards.delete(name);
    }
    for (const robot of robots) {
      const card = this.cards.get(robot.robot) ?? this.add(robot.robot);
      card.fill(robot, own, drawn[robot.robot]);
      card.offer(robots.filter((one) => one.stop?.is_mine));
    }
    const wanted = [own.robot, this.chosen].find((name) => name !== undefined && names.includes(name));
    this.enlarge(wanted ?? names[0] ?? "");
    if (isNew) this.watch();
  }

  /** @param {string} name */
  add(name) {
    /** @type {Act} */
    const act = (what, robot, more) => {
      if (what === "enlarge") {
        this.chosen = name;
        this.enlarge(name);
      } else this.act(what, robot, more);
    };
    const card = new Card({ name, act, drawn: (number) => this.say({ do: "drawn", robot: name, number }) });
    this.cards.set(name, card);
    this.thumbs.append(card.root);
    return card;
  }

  /**
   * Show this robot large; a press in progress on a card still hits its button.
   *
   * @param {string} name
   */
  enlarge(name) {
    if (name === this.large && this.stage.firstElementChild?.getAttribute("data-robot") === name) return;
    this.large = name;
    const focus = document.activeElement;
    for (const [one, { root }] of [...this.cards].sort(([one], [other]) => readingOrder(one, other))) {
      root.classList.toggle("is-large", one === name);
      (one === name ? this.stage : this.thumbs).append(root);
    }
    if (focus instanceof HTMLElement && focus.closest(".robot")) focus.focus({ preventScroll: true });
    if (this.cards.size > MOST_WATCHED) this.watch();
  }

  /** Ask for as many pictures as the server sends, first for the large one. */
  watch() {
    const names = [...this.cards.keys()].sort(
      (one, other) => Number(other === this.large) - Number(one === this.large),
    );
    this.say({ do: "watch", robots: names.slice(0, MOST_WATCHED) });
  }

  /** @param {Picture} picture */
  saw(picture) {
    this.cards.get(picture.robot)?.screen.saw(picture);
  }

  /**
   * The robot whose card has the focus, else the large one.
   *
   * @returns {string}
   */
  get meant() {
    return document.activeElement?.closest(".robot")?.getAttribute("data-robot") ?? this.large;
  }

  /** Ignore a button that is held down on a card. */
  letGo() {
    for (const card of this.cards.values()) {
      card.dropLift();
      card.dropLiftOwn();
    }
  }

  /** The connection ended: this page no longer knows the robots' holders. */
  cut() {
    for (const card of this.cards.values()) {
      card.root.classList.remove("is-mine");
      set(card.state, "not known");
      set(card.holder, "");
    }
  }
}

/** A robot without a holder reports nothing, and its battery loses little in a minute. */
const REPORTED_S = 60;

class Card {
  /** @param {{ name: string, act: Act, drawn: (number: number) => void }} given */
  constructor({ name, act, drawn }) {
    this.name = name;
    this.act = act;
    /** @type {StopView | null} */
    this.stop = null;
    this.root = make("article", "robot");
    this.root.dataset.robot = name;
    this.root.setAttribute("aria-label", `robot ${name}`);
    this.screen = new Screen({ name, drawn, tapped: (tap) => this.tapped(tap) });
    // Over the picture of a stopped robot: the authors of the stop, and the lift button, far from every Stop button.
    this.standing = make("div", "standing");
    this.standing.hidden = true;
    this.whose = make("p", "whose");
    this.lift = make("button", "lift", "Hold to lift");
    this.lift.type = "button";
    this.needs = make("p", "needs");
    this.dropLift = actWhenHeld(this.lift, () => {
      if (this.stop) this.act("lift", this.name, { number: this.stop.number });
    });
    this.liftOwn = make("button", "lift-own");
    this.liftOwn.type = "button";
    /** @type {RobotView[]} */
    this.ownStops = [];
    this.dropLiftOwn = actWhenHeld(this.liftOwn, () => {
      for (const { robot, stop } of this.ownStops) this.act("lift", robot, { number: stop?.number });
    });
    this.standing.append(this.whose, this.lift, this.liftOwn, this.needs);
    this.screen.root.append(this.makeEnlarge(), this.standing);
    const top = make("div", "top");
    const title = make("h2", "", name);
    this.state = make("span", "state");
    top.append(title, this.state);
    this.holder = make("p", "holder");
    this.gauges = make("p", "gauges");
    this.reports = new Gauges(name);
    this.take = this.button("Take over", "take");
    this.root.append(this.screen.root, top, this.holder, this.gauges, this.reports.root, this.makeButtons());
  }

  /** @param {Tap | null} tap */
  tapped(tap) {
    if (tap === null) notice(`The picture of ${this.name} is old: tap the place on the map.`);
    else this.act("order_in_picture", this.name, { tap });
  }

  makeEnlarge() {
    const button = this.button("", "enlarge");
    button.className = "enlarge";
    button.setAttribute("aria-label", `Show ${this.name} large`);
    return button;
  }

  makeButtons() {
    const row = make("div", "row");
    const stop = this.button("Stop", "stop_robot");
    stop.className = "emergency";
    stop.setAttribute("aria-label", `Stop ${this.name}${ofMission()}`);
    const why = this.button("Why?", "why");
    why.setAttribute("aria-label", `Why is ${this.name} as it is?`);
    row.append(this.take, stop, why);
    return row;
  }

  /**
   * @param {string} label
   * @param {string} what
   */
  button(label, what) {
    return makeButton(label, () => this.act(what, this.name));
  }

  /**
   * @param {RobotView} robot
   * @param {Partial<OwnView>} own
   * @param {number} [latency_s]
   */
  fill(robot, own, latency_s) {
    this.screen.latencyMs = 1000 * (latency_s ?? 0);
    this.root.classList.toggle("is-mine", robot.is_mine);
    this.fillStop(robot.stop);
    const isStopped = robot.stop !== null;
    const whose = robot.is_mine ? "yours" : robot.holder ? "held" : "free";
    set(this.state, !robot.is_up ? "down" : isStopped ? "STOPPED" : whose);
    const next = robot.waiting.length ? `; next: ${robot.waiting[0]}` : "";
    const who = robot.is_mine ? "you" : robot.holder;
    set(this.holder, who ? `${who}: ${robot.feedback || robot.because}${next}` : robot.feedback + next);
    const isReported = robot.reported_age_s >= 0 && robot.reported_age_s <= REPORTED_S;
    const gauges = isReported ? robot.gauges : [];
    set(this.gauges, lineOf(gauges));
    this.reports.show(gauges);
    const isWanted = own.is_asked && own.robot === this.name;
    const take = robot.is_mine ? "Yours" : isWanted ? "Waiting…" : "Take over";
    set(this.take, take);
    this.take.setAttribute("aria-label", `${take} ${this.name}`);
    this.take.disabled = robot.is_mine || isWanted === true;
  }

  /** @param {StopView | null} stop */
  fillStop(stop) {
    if (stop?.number !== this.stop?.number) this.dropLift(); // the held button was meant for another stop
    this.stop = stop;
    this.root.classList.toggle("is-stopped", stop !== null);
    this.standing.hidden = stop === null;
    if (stop === null) return;
    const whom = stop.is_mine ? "you" : stop.by_user;
    const unsure = stop.is_confirmed ? "" : "; the wheels may turn for a moment more";
    set(this.whose, `STOPPED by ${whom}${lasting(stop.age_s)}${stop.reason ? `: ${stop.reason}` : ""}${unsure}`);
    set(this.needs, stop.lift_line === HOLD ? "" : stop.lift_line);
    this.lift.setAttribute("aria-label", `Hold to lift the stop of ${this.name} by ${whom}`);
  }

  /**
   * Offer to lift all stops that only this operator set, if this card has one of them and there are more.
   *
   * @param {RobotView[]} ownStops Robots with such a stop.
   */
  offer(ownStops) {
    const numbers = (/** @type {RobotView[]} */ of) => of.map(({ robot, stop }) => `${robot} ${stop?.number}`).join();
    if (numbers(ownStops) !== numbers(this.ownStops)) this.dropLiftOwn(); // the held button was meant for other stops
    this.ownStops = ownStops;
    this.liftOwn.hidden = !this.stop?.is_mine || ownStops.length < 2;
    set(this.liftOwn, `Hold to lift your ${ownStops.length} stops`);
  }

  /** @param {number} now */
  look(now) {
    this.root.classList.toggle("is-stale", this.screen.look(now));
  }
}
