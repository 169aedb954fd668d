// This operator's own part: the held robot, the lost robot, the questions of other operators.

import { find } from "./dom.js";
import { remembered } from "./memory.js";
import { atStick } from "./orders.js";
import { lasting, set, shortened } from "./text.js";

/** @import { Commands } from "./commands.js" */
/** @import { Driving } from "./driving.js" */
/** @import { ArcAbilities, KindChoice, OwnView } from "./messages.d.ts" */
/** @import { Act } from "./types.d.ts" */

const MEMORY = "held";
const NAME_ON_BUTTON = 16; // chosen: letters, two lines on a phone
const READ_MS = 700; // chosen: longer than a double press, shorter than it takes to read a question

/** Shows `own` of the view; `act(what, name)` carries out a person's action. */
export class Hand {
  /** @param {{ act: Act, driving: Driving, commands: Commands }} given */
  constructor({ act, driving, commands }) {
    this.act = act;
    this.driving = driving;
    this.commands = commands;
    /** @type {OwnView | null} */
    this.own = null;
    /** @type {ArcAbilities | null} */
    this.abilities = null;
    this.now_s = 0;
    this.ordered = ""; // the robot that the stick can take back from its order
    this.memory = new Memory();
    this.question = 0; // number of the shown one; 0: none
    /** @type {ReturnType<typeof setTimeout> | 0} */
    this.timer = 0;
    find("take").addEventListener("click", () => act("take", this.own?.robot ?? ""));
    find("release").addEventListener("click", () => act("release"));
    find("may-i").addEventListener("click", () => act("may_i"));
    find("stop-mine").addEventListener("click", () => act("stop_mine"));
    find("halt").addEventListener("click", () => act("halt"));
    find("consent-yes").addEventListener("click", () => act("consent", "yes", { number: this.question }));
    find("consent-no").addEventListener("click", () => act("consent", "no", { number: this.question }));
    find("retake").addEventListener("click", () => {
      this.memory.forget();
      act("take", find("retake").dataset.robot);
    });
    find("dismiss").addEventListener("click", () => {
      this.memory.forget();
      act("dismiss");
      this.showLost();
    });
    find("kind").addEventListener("change", () => this.showChoice());
    find("take-so").addEventListener("click", () => {
      act("take", this.own?.robot ?? "", { kind: find("kind", HTMLSelectElement).value });
    });
    find("speed").addEventListener("input", () => this.showSpeed());
    this.showSpeed();
    addEventListener("pagehide", () => this.cut("this page was left", 0));
  }

  get held() {
    return this.own?.is_held ? this.own.robot : "";
  }

  /** The robot that the stick moves: it is held, or carries out an order that a touch of the stick would end. */
  get stick() {
    return this.held || this.ordered;
  }

  /** The newest shown moment; a press from an earlier moment moves nothing. */
  get moment() {
    return this.own?.moment ?? 0;
  }

  get speed() {
    return Number(find("speed", HTMLInputElement).value) / 100;
  }

  /** @param {number} steps */
  change(steps) {
    const slider = find("speed", HTMLInputElement);
    if (steps > 0) slider.stepUp(steps);
    else slider.stepDown(-steps);
    this.showSpeed();
  }

  /** @param {ArcAbilities | null} abilities */
  know(abilities) {
    this.abilities = abilities;
    this.commands.know(abilities);
    this.showKinds(abilities?.kinds ?? []);
    this.showSpeed();
    if (this.own !== null) this.driving.turn(this.stick !== "" && this.canMove);
  }

  /**
   * Offer the kinds of ARC for the held robot; the first kind is the present one.
   *
   * @param {KindChoice[]} kinds
   */
  showKinds(kinds) {
    find("kind").replaceChildren(...kinds.map(({ kind, title }) => new Option(title, kind)));
    find("kinds").hidden = kinds.length === 0;
    this.showChoice();
  }

  showChoice() {
    find("take-so", HTMLButtonElement).disabled = find("kind", HTMLSelectElement).selectedIndex <= 0;
  }

  get canMove() {
    return this.abilities === null || this.abilities.reach !== null;
  }

  showSpeed() {
    const most = this.abilities?.reach?.forward_m_s;
    const there = most === undefined ? "" : ` (${(most * this.speed).toFixed(2)} m/s)`;
    set(find("speed-shown"), `${find("speed", HTMLInputElement).value} %${there}`);
  }

  /**
   * The connection ended: another operator may have the robot by now.
   *
   * @param {string} why
   * @param {number} ageMs
   */
  cut(why, ageMs) {
    if (this.held) this.memory.keep(this.held, why, Date.now() - ageMs);
    set(find("own"), this.held ? `You held ${this.held} when the connection ended.` : "Not connected.");
    this.own = null;
    this.ordered = "";
    this.driving.turn(false);
    this.commands.turn(false);
    document.body.dataset.held = "";
    document.body.classList.remove("is-asking");
  }

  /**
   * @param {OwnView} own
   * @param {number} now_s
   */
  show(own, now_s) {
    const before = this.own;
    this.own = own;
    this.ordered = atStick(own.orders, own.robot);
    document.body.dataset.ordered = this.ordered;
    this.now_s = now_s;
    if (isOther(before, own))
      this.driving.letGo(own.is_held); // a held control belongs to an earlier moment
    else if (own.moment !== before?.moment) this.driving.letGo();
    if (own.is_asked) this.memory.forget();
    set(find("own"), own.status);
    set(find("taken"), own.taken_because ? `Taken from you: ${own.taken_because}` : "");
    set(find("applied"), own.applied ? `applied: ${own.applied}` : "");
    set(find("asked"), own.asked);
    this.showLost();
    this.showConsent();
    find("may-i", HTMLButtonElement).disabled = !own.is_asked || own.is_held;
    find("take", HTMLButtonElement).disabled = own.is_asked;
    this.commands.turn(own.is_held);
    this.showHold(own);
    document.body.dataset.held = this.held;
    document.body.classList.toggle("is-asking", own.is_asked);
  }

  /**
   * Show what can be done with the robot at the stick.
   *
   * @param {OwnView} own
   */
  showHold(own) {
    const stick = this.stick;
    this.driving.turn(stick !== "" && this.canMove);
    find("release", HTMLButtonElement).disabled = !own.is_asked && stick === "";
    find("halt", HTMLButtonElement).disabled = stick === "";
    find("stop-mine").hidden = stick === "";
    set(find("stop-mine"), `Stop ${shortened(stick, NAME_ON_BUTTON)}`);
    find("stop-mine").setAttribute("aria-label", `Stop ${stick}`);
  }

  /** Show the lost robot with time and reason, and offer it again: by the server's report, else by this page's own. */
  showLost() {
    const told = this.own?.lost ?? null;
    const kept = told === null ? this.memory.kept : null;
    const lost = told ?? kept;
    find("lost").hidden = lost === null || this.own?.is_asked === true;
    if (lost === null || find("lost").hidden) return;
    const age_s = told !== null ? this.now_s - told.at_s : (Date.now() - (kept?.at ?? 0)) / 1000;
    set(find("lost-line"), `You lost ${lost.robot}${lasting(age_s)}: ${lost.why}`);
    const retake = find("retake", HTMLButtonElement);
    set(retake, `Take ${lost.robot} again`);
    retake.dataset.robot = lost.robot;
    retake.disabled = told !== null && !told.may_retake;
  }

  /** Disable the answers for a moment: a press now is meant for what was there before this question. */
  delayAnswers() {
    const answers = ["consent-yes", "consent-no"].map((id) => find(id, HTMLButtonElement));
    for (const answer of answers) answer.disabled = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      for (const answer of answers) answer.disabled = false;
    }, READ_MS);
  }

  showConsent() {
    const consent = this.own?.consent ?? null;
    find("consent").hidden = consent === null;
    const number = consent?.number ?? 0;
    if (number !== this.question) this.delayAnswers();
    this.question = number;
    if (consent === null) return;
    const others = consent.others ? `, ${consent.others} more ask` : "";
    const left = `${Math.ceil(consent.left_s)} s${others}`;
    set(find("consent-line"), `${consent.line} (${left})`);
    const isLift = consent.topic === "lift";
    set(find("consent-yes"), isLift ? "Let it move" : "Let them have it");
    set(find("consent-no"), isLift ? "Keep it stopped" : "Keep it");
  }
}

/**
 * Whether robot, hold or stop have changed, so that held controls must be released first.
 *
 * @param {OwnView | null} before
 * @param {OwnView} own
 */
export function isOther(before, own) {
  if (before === null) return true;
  return (
    before.is_held !== own.is_held ||
    before.robot !== own.robot ||
    before.epoch !== own.epoch ||
    before.stop?.number !== own.stop?.number
  );
}

/** The robot this tab held when its connection ended: the record outlives the connection, a reload, and the server. */
class Memory {
  /**
   * @param {string} robot
   * @param {string} why
   * @param {number} at
   */
  keep(robot, why, at) {
    sessionStorage.setItem(remembered(MEMORY), JSON.stringify({ robot, why, at }));
  }

  forget() {
    sessionStorage.removeItem(remembered(MEMORY));
  }

  /** @returns {{ robot: string, why: string, at: number } | null} */
  get kept() {
    return JSON.parse(sessionStorage.getItem(remembered(MEMORY)) ?? "null");
  }
}
