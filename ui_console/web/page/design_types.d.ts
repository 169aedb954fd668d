// What the modules of the designer's page hand to each other.

import type { Said } from "./design_messages.d.ts";

/** Where an element stands: its number in what holds it, from the mission inwards; the mission itself has none. */
export type Path = number[];

/** What changes, saves or reads the draft; it names the revision of the draft that it was meant for. */
export type DraftChange = Extract<Said, { revision: number }>;

type Wanted<One> = One extends DraftChange ? Omit<One, "revision"> & { revision?: number } : never;

/** A change that waits; without a revision it is meant for the draft that its author saw, see `Changes`. */
export type WantedChange = Wanted<DraftChange>;

/** Makes a change when its turn comes; null: nothing is to be done any more. */
export type MakeChange = () => WantedChange | null;

/** Has a change made and sent in its turn. */
export type Change = (make: MakeChange) => void;

/** Where in a row of the tree a drop is meant. */
export type RowPart = "before" | "into" | "after";

/** What is dragged: a part of the palette, or an element of the tree. */
export type Dragged = { told: string; tag: string; revision?: number } & ({ label: string } | { path: Path });

/** What a drop means: where it is marked, and what it does. */
export interface DropPlace {
  row: HTMLElement;
  part: RowPart;
  do: () => void;
}

/** Where a value is written or chosen. */
export type Input = HTMLInputElement | HTMLSelectElement;
