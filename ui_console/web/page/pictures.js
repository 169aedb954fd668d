// One card for each robot: its newest picture, who has it, and what can be done about it.

const STALE_MS = 1000; // as in the console model: do not drive by it

export class Cards {
  constructor({ root, say, act }) {
    Object.assign(this, { root, say, act });
    this.cards = new Map();
    setInterval(() => this.age(), 250);
  }

  /** Show these robots; a card that was there stays, with its picture. */
  show(robots, own, drawn) {
    const names = robots.map((robot) => robot.robot);
    let isNew = false;
    for (const [name, card] of this.cards) if (!names.includes(name)) { card.root.remove(); this.cards.delete(name); isNew = true; }
    for (const robot of robots) {
      let card = this.cards.get(robot.robot);
      if (!card) { card = this.make(robot.robot); isNew = true; }
      this.fill(card, robot, own, drawn[robot.robot]);
    }
    if (isNew) this.watch();
  }

  watch() {
    this.say({ do: "watch", robots: [...this.cards.keys()].slice(0, 16) });
  }

  make(name) {
    const root = document.createElement("article");
    root.className = "robot";
    root.dataset.robot = name;
    root.setAttribute("aria-label", `robot ${name}`);
    const make = (tag, className, parent = root) => {
      const made = document.createElement(tag);
      made.className = className;
      parent.append(made);
      return made;
    };
    const screen = make("div", "screen");
    const canvas = make("canvas", "", screen);
    canvas.width = 320; canvas.height = 240;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `picture of ${name}`);
    const age = make("span", "age", screen);
    const top = make("div", "top");
    const title = make("h3", "", top);
    title.textContent = name;
    const state = make("span", "state", top);
    const holder = make("p", "holder");
    const row = make("div", "row");
    const button = (label, what) => {
      const made = make("button", "", row);
      made.type = "button";
      made.textContent = label;
      made.addEventListener("click", () => this.act(what(), name));
      return made;
    };
    const card = { root, canvas, age, state, holder, drawnAt: 0, isStopped: false, isMine: false, pending: null, busy: false, count: 0, rate: 0, since: performance.now() };
    card.take = button("Take over", () => (card.isMine ? "release" : "take"));
    card.stop = button("Stop", () => (card.isStopped ? "lift" : "stop_robot"));
    card.stop.className = "emergency";
    button("Why?", () => "why");
    this.root.append(root);
    this.cards.set(name, card);
    return card;
  }

  fill(card, robot, own, latency) {
    card.isMine = robot.is_mine;
    card.isStopped = robot.stop !== null;
    card.latency = latency;
    card.root.classList.toggle("is-mine", robot.is_mine);
    card.root.classList.toggle("is-stopped", card.isStopped);
    set(card.state, !robot.is_up ? "down" : card.isStopped ? `STOPPED by ${robot.stop.by}` : robot.is_mine ? "yours" : robot.holder ? "held" : "free");
    const next = robot.waiting.length ? `; next: ${robot.waiting[0].who}` : "";
    set(card.holder, robot.holder ? `${robot.is_mine ? "you" : robot.holder}: ${robot.feedback || robot.because}${next}` : robot.feedback + next);
    const wanted = own.is_asked && own.robot === robot.robot && !robot.is_mine;
    set(card.take, robot.is_mine ? "Release" : wanted ? "Waiting…" : "Take over");
    set(card.stop, card.isStopped ? "Let it move" : "Stop");
    card.stop.classList.toggle("emergency", !card.isStopped);
  }

  /** A picture came: the newest that is not drawn yet takes the place of an older one. */
  async saw(picture) {
    const card = this.cards.get(picture.robot);
    if (!card) return;
    card.pending = picture;
    if (card.busy) return;
    card.busy = true;
    while (card.pending !== null) {
      const { robot, number, jpeg } = card.pending;
      card.pending = null;
      const bitmap = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" })).catch(() => null);
      if (bitmap !== null) {
        await new Promise(requestAnimationFrame);
        if (card.canvas.width !== bitmap.width || card.canvas.height !== bitmap.height) {
          card.canvas.width = bitmap.width; card.canvas.height = bitmap.height;
        }
        card.canvas.getContext("2d").drawImage(bitmap, 0, 0);
        bitmap.close();
        card.drawnAt = performance.now();
        card.count += 1;
        card.canvas.dataset.number = number;
      }
      this.say({ do: "drawn", robot, number });
    }
    card.busy = false;
  }

  age() {
    const now = performance.now();
    for (const card of this.cards.values()) {
      const span = now - card.since;
      if (span >= (card.rate === 0 ? 500 : 2000)) { card.rate = (1000 * card.count) / span; card.count = 0; card.since = now; }
      const old = now - card.drawnAt;
      const isStale = card.drawnAt === 0 || old > STALE_MS;
      card.root.classList.toggle("is-stale", isStale);
      const latency = card.latency === undefined ? "" : ` · ${Math.round(1000 * card.latency)} ms`;
      set(card.age, card.drawnAt === 0 ? "no picture" : isStale ? `${(old / 1000).toFixed(0)} s old` : `${card.rate.toFixed(0)}/s${latency}`);
    }
  }
}

function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
