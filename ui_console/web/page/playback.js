// The time of a recording: play, pause, step, a line to drag, and markers of grants, alarms and people on it.

import { find, query } from "./dom.js";
import { drawn } from "./svg.js";
import { seconds, set } from "./text.js";

/** @import { Marker, PlaybackView } from "./messages.d.ts" */
/** @import { Act, Say } from "./types.d.ts" */

const LANES = ["alarm", "operator", "grant", "revoked"]; // from the top
const LANE_PX = 8;
/** @type {Record<string, string>} */
const KINDS = { alarm: "alarm", operator: "a person's action", grant: "grant", revoked: "end of a grant" };

/**
 * The first marker after a time, or the last one before it; none: null.
 *
 * @param {Marker[]} markers In the order of time.
 * @param {number} at_s
 * @param {1 | -1} way
 * @returns {Marker | null}
 */
export function nextMarker(markers, at_s, way) {
  const beyond = markers.filter((marker) => way * (marker.at_s - at_s) > 1e-3);
  return beyond.at(way === 1 ? 0 : -1) ?? null;
}

/** The controls above a page that shows a recording. */
export class Playback {
  /** @param {{ say: Say, act: Act }} given */
  constructor({ say, act }) {
    this.say = say;
    this.act = act;
    /** @type {PlaybackView | null} */
    this.now = null;
    /** @type {Marker[] | null} */
    this.markers = null; // until they are read from the recording
    /** @type {Marker | null} */
    this.told = null;
    this.isDragged = false;
    this.root = find("playback");
    this.line = find("play-line", HTMLInputElement);
    this.speed = find("play-speed", HTMLSelectElement);
    this.play = find("play", HTMLButtonElement);
    this.play.addEventListener("click", () => this.playOrPause());
    find("step").addEventListener("click", () => this.say({ do: "step_on" }));
    find("earlier").addEventListener("click", () => this.goToNext(-1));
    find("later").addEventListener("click", () => this.goToNext(1));
    find("play-why").addEventListener("click", () => this.told && this.act("why", this.told.name));
    this.speed.addEventListener("change", () => {
      if (this.now?.is_playing) this.say({ do: "play_on", speed: Number(this.speed.value) });
    });
    this.line.addEventListener("input", () => {
      this.isDragged = true;
      set(find("play-at"), seconds(Number(this.line.value)));
    });
    this.line.addEventListener("change", () => {
      this.isDragged = false;
      this.tell(null);
      this.say({ do: "go_to", at_s: Number(this.line.value) });
    });
  }

  /** @param {PlaybackView} view */
  show(view) {
    if (this.now === null) this.begin(view);
    this.now = view;
    set(this.play, view.is_playing ? "Pause" : "Play");
    if (this.isDragged) return;
    this.line.value = String(view.at_s);
    this.line.setAttribute("aria-valuetext", seconds(view.at_s));
    set(find("play-at"), `${seconds(view.at_s)} of ${seconds(view.end_s)}`);
  }

  /** @param {PlaybackView} view */
  begin(view) {
    document.body.classList.add("is-recording");
    this.root.hidden = false;
    this.line.min = String(view.begin_s);
    this.line.max = String(view.end_s);
    this.line.step = "any";
  }

  playOrPause() {
    this.say(this.now?.is_playing ? { do: "pause" } : { do: "play_on", speed: Number(this.speed.value) });
  }

  /** @param {1 | -1} way */
  goToNext(way) {
    const marker = nextMarker(this.markers ?? [], this.now?.at_s ?? 0, way);
    if (marker) this.goTo(marker);
    else if (this.markers === null) set(find("play-told"), "the markers are still being read");
    else set(find("play-told"), way === 1 ? "nothing is marked later" : "nothing is marked earlier");
  }

  /** @param {Marker} marker */
  goTo(marker) {
    this.tell(marker);
    this.say({ do: "go_to", at_s: marker.at_s });
  }

  /** @param {Marker | null} marker */
  tell(marker) {
    this.told = marker;
    set(find("play-told"), marker ? `${seconds(marker.at_s)}: ${marker.line}` : "");
    find("play-why").hidden = marker === null;
  }

  /** @param {Marker[]} markers */
  mark(markers) {
    this.markers = markers;
    const bar = query(this.root, "svg", SVGElement);
    const [from, to] = [Number(this.line.min), Number(this.line.max)];
    const marks = markers.map((marker) => {
      const x = `${(100 * (marker.at_s - from)) / Math.max(to - from, 1e-9)}%`;
      const y = LANES.indexOf(marker.kind) * LANE_PX;
      const mark = drawn("rect", { x, y, width: 4, height: LANE_PX - 1, class: `mark ${marker.kind}` });
      mark.append(drawn("title", {}, `${seconds(marker.at_s)}, ${KINDS[marker.kind]}: ${marker.line}`));
      mark.addEventListener("click", () => this.goTo(marker));
      return mark;
    });
    bar?.replaceChildren(...marks);
  }
}
