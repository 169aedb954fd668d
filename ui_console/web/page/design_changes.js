// Queue of changes to the draft.

import { fits } from "./link.js";

/** @import { DraftChange, MakeChange } from "./design_types.d.ts" */

/**
 * Sends a change as soon as the previous one is done; the change is created only then, so that its revision is not too
 *     old.
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
    /** @type {MakeChange[]} */
    this.waiting = [];
    /** @type {DraftChange | null} */
    this.underway = null; // the change that was sent and is neither done nor refused yet
  }

  /** @param {MakeChange} make */
  add(make) {
    this.waiting.push(make);
    this.pump();
  }

  /** The server has carried out or refused the last change. */
  handled() {
    this.underway = null;
    this.pump();
  }

  /** The connection ended: drop all changes. */
  drop() {
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
      const message = this.waiting.shift()?.();
      if (message === undefined) return;
      if (message === null) continue;
      this.underway = { ...message, revision: message.revision ?? revision };
      if (!fits(this.underway)) {
        this.refused("This is too long for the page", "Write it into the file.");
        this.underway = null;
        continue;
      }
      if (this.say(this.underway)) return;
      this.refused("NOT CONNECTED: this was not done", "");
      this.drop();
    }
  }
}
