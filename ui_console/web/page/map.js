// The map: robots are selected on it and sent to places; their orders are shown, and taken back.

import { find, keepingFocus, make, makeButton, offer } from "./dom.js";
import { age, drawBody, drawCross, drawFloor, drawGoal } from "./map_draw.js";
import { listed, meantBy, Plan, stepped } from "./map_plan.js";
import { isOver } from "./orders.js";
import { drawn } from "./svg.js";
import { readingOrder, set } from "./text.js";

/** @import { BodyView, FloorView, OrderView, View } from "./messages.d.ts" */
/** @import { Act, Point } from "./types.d.ts" */

const STEP_M = 0.25; // chosen: a Scout's two lengths; with shift a tenth of it
const FINE = 0.1;
const HEIGHT_SHARE = 0.62; // chosen: of the window, so that the controls beside it stay in sight

/** Shows the floor; `act` carries out an order, `inHand` is the robot that the stick is at. */
export class RobotMap {
  /** @param {{ act: Act, inHand: () => string }} given */
  constructor({ act, inHand }) {
    this.act = act;
    this.inHand = inHand;
    this.root = find("map");
    this.floorBox = find("map-floor");
    this.canvas = find("map-image", HTMLCanvasElement);
    this.chips = find("map-bodies");
    this.told = find("map-told");
    this.target = find("map-target", HTMLSelectElement);
    this.svg = /** @type {SVGSVGElement} */ (
      drawn("svg", { id: "map-plan", role: "application", tabindex: 0, "data-keys": "own" })
    );
    this.svg.setAttribute("aria-describedby", "map-help");
    this.svg.setAttribute("aria-label", "Map");
    this.still = drawn("g", {});
    this.moving = drawn("g", {});
    this.svg.append(this.still, this.moving);
    this.floorBox.append(this.svg);
    /** @type {FloorView} */
    this.floor = { width_m: 1, depth_m: 1, shapes: [], image: "" };
    this.plan = new Plan(this.floor, 1, 1);
    /** @type {BodyView[]} */
    this.bodies = [];
    /** @type {OrderView[]} */
    this.orders = [];
    /** @type {Set<string>} */
    this.selected = new Set();
    /** @type {Point | null} */
    this.cross = null;
    this.image = "";
    this.svg.addEventListener("mousedown", (event) => event.preventDefault()); // the arrows stay with the stick
    this.svg.addEventListener("click", (event) => this.tap([event.offsetX, event.offsetY]));
    this.svg.addEventListener("keydown", (event) => this.key(event));
    this.svg.addEventListener("focus", () => this.placeCross(this.cross ?? this.middle));
    find("map-go").addEventListener("click", () => this.goToCross());
    find("map-watch").addEventListener("click", () => this.order("watch_for_motion", "watch from where it stands"));
    find("map-return").addEventListener("click", () => this.order("return_home", "return"));
    find("map-follow").addEventListener("click", () => this.follow());
    find("map-end").addEventListener("click", () => this.end(this.meant));
    addEventListener("resize", () => this.fit());
  }

  /** The robots that an order concerns. */
  get meant() {
    return meantBy(this.selected, this.inHand());
  }

  /** @returns {Point} */
  get middle() {
    return [this.floor.width_m / 2, this.floor.depth_m / 2];
  }

  /**
   * @param {Partial<View>} view
   * @param {Partial<View>} changed
   */
  show(view, changed) {
    this.bodies = view.bodies ?? [];
    this.orders = (view.own?.orders ?? []).filter((order) => !isOver(order));
    const names = this.bodies.filter((body) => body.is_robot).map((body) => body.name);
    for (const name of this.selected) if (!names.includes(name)) this.selected.delete(name);
    const isNew = this.root.hidden && view.floor != null;
    this.root.hidden = view.floor == null;
    if (view.floor == null) return;
    if (changed.floor != null || isNew) {
      this.floor = view.floor;
      this.fit();
      if (this.floor.image !== this.image) this.drawImage(this.floor.image);
    }
    this.draw();
  }

  /** Draw the floor as large as there is room. */
  fit() {
    if (this.root.hidden) return;
    this.plan = new Plan(this.floor, this.floorBox.clientWidth, HEIGHT_SHARE * innerHeight);
    const { widthPx, heightPx } = this.plan;
    this.svg.setAttribute("width", String(widthPx));
    this.svg.setAttribute("height", String(heightPx));
    this.canvas.style.width = `${widthPx}px`;
    this.canvas.style.height = `${heightPx}px`;
    this.still.replaceChildren(...drawFloor(this.floor, this.plan));
    this.draw();
  }

  /**
   * Draw the picture of the plan below the shapes.
   *
   * @param {string} image
   */
  async drawImage(image) {
    this.image = image;
    this.canvas.hidden = image === "";
    if (image === "") return;
    const bytes = Uint8Array.from(atob(image), (letter) => letter.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
    if (this.image !== image) return;
    this.canvas.width = bitmap.width;
    this.canvas.height = bitmap.height;
    this.canvas.getContext("2d")?.drawImage(bitmap, 0, 0);
    bitmap.close();
  }

  draw() {
    const inHand = this.inHand();
    const parts = this.bodies.map((body) =>
      drawBody(body, this.plan, { isMine: body.name === inHand, isSelected: this.selected.has(body.name) }),
    );
    const goals = this.orders.filter((order) => order.kind === "go_to");
    for (const order of goals) {
      const body = this.bodies.find((one) => one.name === order.robot);
      parts.push(...drawGoal(order, body, this.plan));
    }
    if (this.cross) parts.push(...drawCross(this.plan.at(...this.cross)));
    this.moving.replaceChildren(...parts);
    this.drawChips();
    this.drawTargets();
    this.drawButtons();
  }

  /** One button for each robot, for people who do not tap on the map; its text describes the robot on the map. */
  drawChips() {
    const robots = this.bodies.filter((body) => body.is_robot);
    const shown = [...this.chips.querySelectorAll("button")].map((chip) => chip.dataset.body);
    if (shown.join() !== robots.map((body) => body.name).join()) {
      const chips = robots.map((body) => {
        const chip = makeButton("", () => this.toggle(body.name), `map:${body.name}`);
        chip.dataset.body = body.name;
        chip.append(make("strong", "", body.name), make("span", "quiet"));
        return chip;
      });
      keepingFocus(this.chips, () => this.chips.replaceChildren(...chips));
    }
    for (const [number, chip] of [...this.chips.querySelectorAll("button")].entries()) {
      const body = robots[number];
      chip.setAttribute("aria-pressed", String(this.selected.has(body.name)));
      const spread = body.spread_m > 0 ? `±${body.spread_m.toFixed(2)} m` : "";
      const about = [body.source, spread, age(body), body.link, body.does].filter(Boolean).join(", ");
      if (chip.lastElementChild) set(chip.lastElementChild, about);
    }
  }

  drawTargets() {
    const names = this.bodies.map((body) => body.name);
    const chosen = this.target.value;
    if (offer(this.target, names) && names.includes(chosen)) this.target.value = chosen;
  }

  drawButtons() {
    const meant = this.meant;
    const has = (/** @type {string} */ robot) => this.orders.some((one) => one.robot === robot);
    for (const id of ["map-go", "map-watch", "map-return", "map-follow"]) {
      find(id, HTMLButtonElement).disabled = meant.length === 0;
    }
    find("map-end", HTMLButtonElement).disabled = !meant.some(has);
    const who = meant.length ? `Orders are for ${listed(meant)}: tap a place.` : "Select a robot, then tap a place.";
    set(find("map-who"), who);
  }

  // ---------------------------------------------------------------- the operator
  /** @param {Point} point */
  tap(point) {
    const robot = this.plan.robotAt(point, this.bodies);
    if (robot) this.toggle(robot.name);
    else this.goTo(this.plan.place(point));
  }

  /** @param {string} robot */
  toggle(robot) {
    if (!this.selected.delete(robot)) this.selected.add(robot);
    const names = [...this.selected].sort(readingOrder);
    set(this.told, names.length ? `selected: ${listed(names)}` : "no robot is selected");
    this.draw();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step_m = event.shiftKey ? FINE * STEP_M : STEP_M;
    const next = stepped(this.cross ?? this.middle, event.key, step_m, this.floor);
    if (next === null && event.key !== "Enter") return;
    event.preventDefault();
    if (next === null) this.goToCross();
    else this.placeCross(next);
  }

  /** @param {Point} place */
  placeCross(place) {
    this.cross = place;
    set(this.told, `cross at ${told(place)}`);
    this.draw();
  }

  goToCross() {
    this.goTo(this.cross ?? this.middle);
  }

  /** @param {Point} place */
  goTo(place) {
    this.cross = place;
    this.order("go_to", `go to ${told(place)}`, { x_m: place[0], y_m: place[1] });
  }

  follow() {
    const target = this.target.value;
    const robots = this.meant.filter((robot) => robot !== target);
    if (robots.length) this.order("follow", `follow ${target}`, { target }, robots);
    else set(this.told, `${target} cannot follow itself`);
  }

  /**
   * @param {OrderView["kind"]} kind
   * @param {string} words
   * @param {{ x_m?: number, y_m?: number, target?: string }} [more]
   * @param {string[]} [robots]
   */
  order(kind, words, more = {}, robots = this.meant) {
    if (robots.length) {
      set(this.told, `${listed(robots)}: ${words}`);
      this.act("order", kind, { robots, ...more });
    } else set(this.told, "Select a robot first: tap it on the map, or press its button.");
    this.draw();
  }

  /** @param {string[]} robots */
  end(robots) {
    const ordered = robots.filter((robot) => this.orders.some((one) => one.robot === robot));
    if (!ordered.length) return;
    set(this.told, `${listed(ordered)}: the order is stopped`);
    this.act("end_orders", "", { robots: ordered });
  }
}

/** @param {Point} place */
function told([x_m, y_m]) {
  return `${x_m.toFixed(2)}, ${y_m.toFixed(2)} m`;
}
