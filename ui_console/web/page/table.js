// Makes a table of rows.

import { make } from "./dom.js";

/**
 * Each cell knows its column head, so that a narrow screen can show rows as lists; ARIA roles keep it a table for
 *     screen readers.
 *
 * @param {(string | HTMLElement)[]} heads
 * @param {(string | HTMLElement)[][]} rows
 */
export function table(heads, rows) {
  const made = make("table");
  made.setAttribute("role", "table");
  const head = made.createTHead().insertRow();
  head.setAttribute("role", "row");
  for (const one of heads) {
    const cell = make("th");
    cell.scope = "col";
    cell.setAttribute("role", "columnheader");
    cell.append(one);
    head.append(cell);
  }
  const body = made.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    line.setAttribute("role", "row");
    row.forEach((one, number) => {
      const cell = line.insertCell();
      cell.setAttribute("role", "cell");
      cell.dataset.head = typeof heads[number] === "string" ? heads[number] : "";
      cell.append(one);
    });
  }
  return made;
}
