// Additions to an element: the questions of an offer, again after refused answers.

import { ask } from "./design_dialogs.js";

/** @import { DesignView, OfferView, TakeOffer } from "./design_messages.d.ts" */
/** @import { Places } from "./design_places.js" */
/** @import { DraftChange, Path } from "./design_types.d.ts" */

export class Adding {
  /** @param {{ places: Places, view: Partial<DesignView> }} given */
  constructor({ places, view }) {
    this.places = places;
    this.view = view;
    /** @type {OfferView | null} */
    this.asked = null; // the questions whose answers were sent last
  }

  /**
   * Take an offer at an element, once its questions are answered.
   *
   * @param {Path} path
   * @param {OfferView} offer
   * @param {number} [revision]
   */
  async add(path, offer, revision) {
    this.asked = offer;
    const answers = offer.asks.length ? await ask(offer.label, offer.doc, offer.asks) : [];
    if (answers) this.places.take(path, offer.label, answers, revision);
  }

  /**
   * If the last answers were refused, ask again; returns whether they were refused.
   *
   * @param {DraftChange | null} change
   * @param {string} why
   */
  isAskedAgain(change, why) {
    const offer = this.asked;
    if (change?.do !== "take" || !change.answers?.length || offer?.label !== change.label) return false;
    this.askAgain(offer, change, why);
    return true;
  }

  /**
   * @param {OfferView} offer
   * @param {TakeOffer} change
   * @param {string} why
   */
  async askAgain({ asks, doc }, { path, label, answers = [] }, why) {
    const again = asks.map((one, number) => ({ ...one, proposed: answers[number] ?? one.proposed }));
    const revision = this.view.status?.revision;
    const answered = await ask(label, doc, again, why);
    if (answered) this.places.take(path, label, answered, revision);
  }
}
