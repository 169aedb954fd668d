// Emergency stops: sent at once, and shown as confirmed only after the robot's own confirmation.

import { set } from "./text.js";

/** @import { RobotView, StopAllRequest, StopRequest } from "./messages.d.ts" */
/** @import { Say } from "./types.d.ts" */

const CONFIRMED_WITHIN_MS = 1000; // chosen: with a working link, wheels stand within 0.7 s

/** Stops one robot or all, and shows in `shown` the robots whose stop is not confirmed. */
export class Stopping {
  /** @param {{ say: Say, shown: HTMLElement }} given */
  constructor({ say, shown }) {
    this.say = say;
    this.shown = shown;
    /** @type {RobotView[]} */
    this.robots = [];
    /** @type {Map<string, number>} */
    this.pending = new Map(); // robot → time of its stop
    this.unsent = "";
    setInterval(() => this.look(performance.now()), 100);
  }

  /** @param {string} name */
  one(name) {
    this.stop({ do: "stop_robot", robot: name }, [name]);
  }

  all() {
    this.stop(
      { do: "stop_all" },
      this.robots.map((robot) => robot.robot),
    );
  }

  /**
   * @param {StopRequest | StopAllRequest} message
   * @param {string[]} names
   */
  stop(message, names) {
    const isSent = this.say(message);
    this.unsent = isSent ? "" : `NOT SENT: no stop went to ${names.join(", ") || "any robot"}.`;
    for (const name of names) this.pending.set(name, performance.now());
    if (!isSent) this.pending.clear();
    this.look(performance.now());
  }

  /**
   * Update the state of the robots.
   *
   * @param {RobotView[]} robots
   */
  heard(robots) {
    this.robots = robots;
    for (const robot of robots) if (robot.stop?.is_confirmed) this.pending.delete(robot.robot);
    this.look(performance.now());
  }

  /** @param {number} now */
  look(now) {
    const late = [...this.pending].filter(([, at]) => now - at > CONFIRMED_WITHIN_MS).map(([name]) => name);
    const line = late.length ? `NOT CERTAIN to have stopped: ${late.join(", ")}.` : "";
    const said = [this.unsent, line].filter(Boolean).join(" ");
    this.shown.hidden = said === "";
    set(this.shown, said && `${said} Press Stop again, or use another way to stop it.`);
  }
}
