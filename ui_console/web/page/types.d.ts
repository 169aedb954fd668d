// What the modules of the page hand to each other.

import type { Said } from "./messages.d.ts";

/** Sends a message if that is possible now; returns whether it was. */
export type Say = (message: Said) => boolean;

/** Does what a person wants. */
export type Act = (what: string, name?: string, more?: More) => void;

/** What some actions need besides a name. */
export interface More {
  number?: number;
  parameter?: string;
  value?: unknown;
  values?: Record<string, string | number | boolean>;
  role?: string;
  kind?: string;
  robots?: string[];
  x_m?: number;
  y_m?: number;
  target?: string;
  tap?: Tap;
}

/** A picture as it came. */
export interface Picture {
  robot: string;
  number: number;
  jpeg: Uint8Array<ArrayBuffer>;
}

export type LinkState = "fresh" | "old" | "down" | "refused";

/** How the connection is now. */
export interface LinkChange {
  is: LinkState;
  why: string;
  ageMs: number;
}

/** What is shown of the connection. */
export interface Connection {
  readonly is: LinkState;
  readonly isUp: boolean;
  readonly why: string;
  readonly ageMs: number;
}

/** Forward and right, each from −1 to 1. */
export type Stick = [number, number];

/** Two coordinates: meters on the floor, or pixels from the left and from the top. */
export type Point = [number, number];

/** A point of a robot's picture, and the picture's size. */
export interface Tap {
  column_px: number;
  row_px: number;
  width_px: number;
  height_px: number;
}
