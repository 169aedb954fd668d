// One change of the draft after the other.

/**
 * Says a change as soon as the one before it was done; what it is about is looked at only then, or refused as too old.
 *
 * `say` returns whether it was sent, `revision` the draft's, undefined if none is known yet; `refused` is called when a
 * change cannot be said.
 */
export class Changes {
  constructor({ say, revision, refused }) {
    Object.assign(this, { say, revision, refused });
    this.waiting = [];
    this.underway = null; // what was said and is neither done nor refused yet
  }

  /** `make` returns the change when its turn comes; null: nothing is to be done any more. */
  add(make) {
    this.waiting.push(make);
    this.pump();
  }

  /** The server has done or refused what was said last. */
  handled() {
    this.underway = null;
    this.pump();
  }

  /** The connection ended: nothing of it is said any more. */
  drop() {
    this.underway = null;
    this.waiting.length = 0;
  }

  pump() {
    while (this.underway === null && this.waiting.length && this.revision() !== undefined) {
      const message = this.waiting.shift()();
      if (message === null) continue;
      this.underway = { revision: this.revision(), ...message };
      if (this.say(this.underway)) return;
      this.refused("NOT CONNECTED: this was not done", "");
      this.drop();
    }
  }
}
