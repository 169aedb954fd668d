// Queue of changes to the draft.

import { fits } from "./link.js";

/** @import { DraftChange, MakeChange } from "./design_types.d.ts" */

const LOOK = "When it is connected again, look at the mission, and repeat the change if you still want it.";

/**
 * Sends a change as soon as the previous one is done, and creates it only then. It is meant for the draft that its
 * author saw, with this page's own changes before it: if another designer changed the draft meanwhile, the server
 * refuses it, because its path may be that of another element by now.
 *
 * `say` returns whether it was sent, `revision` the draft's, undefined if none is known yet; `refused` is called when a
 * change cannot be sent, `busy` with whether a change waits for the server.
 */
export class Changes {
  /**
   * @param {{ say: (change: DraftChange) => boolean, revision: () => number | undefined,
   *   refused: (text: string, remedy: string) => void, busy?: (isBusy: boolean) => void }} given
   */
  constructor({ say, revision, refused, busy = () => {} }) {
    this.say = say;
    this.revision = revision;
    this.refused = refused;
    this.busy = busy;
    /** @type {{ make: MakeChange, revision: number | undefined }[]} */
    this.waiting = [];
    this.isRefused = false; // the change underway
    /** @type {DraftChange | null} */
    this.underway = null; // the change that was sent and is neither done nor refused yet
  }

  /** @param {MakeChange} make */
  add(make) {
    this.waiting.push({ make, revision: this.revision() });
    this.pump();
  }

  /** The server has refused the last change, or asks for more before it; `handled` follows. */
  refuse() {
    this.isRefused = true;
  }

  /** The server is done with the last change. A change that it carried out is the next revision. */
  handled() {
    const before = this.underway?.revision,
      now = this.revision();
    if (before !== undefined && now !== undefined && now > before && !this.isRefused)
      for (const one of this.waiting) if (one.revision === before) one.revision = before + 1;
    this.isRefused = false;
    this.underway = null;
    this.pump();
  }

  /** The connection ended: drop all changes. The server may have carried out the one underway. */
  drop() {
    if (this.underway !== null) this.refused("NOT CONNECTED: it is not known whether this was done", LOOK);
    this.underway = null;
    this.waiting.length = 0;
    this.busy(false);
  }

  pump() {
    this.send();
    this.busy(this.underway !== null);
  }

  send() {
    const revision = this.revision();
    if (revision === undefined) return;
    while (this.underway === null) {
      const next = this.waiting.shift();
      if (next === undefined) return;
      const message = next.make();
      if (message === null) continue;
      this.underway = { ...message, revision: message.revision ?? next.revision ?? revision };
      if (!fits(this.underway)) {
        this.refused("This is too long for the page", "Write it into the file.");
        this.underway = null;
        continue;
      }
      if (this.say(this.underway)) return;
      this.refused("NOT CONNECTED: this was not done", "");
      this.underway = null;
      this.drop();
    }
  }
}
