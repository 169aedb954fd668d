// Rows become a table.

/**
 * Each cell knows its head, so that a narrow screen can show rows as lists; the roles say that it is a table still.
 *
 * @param {(string | HTMLElement)[]} heads
 * @param {(string | HTMLElement)[][]} rows
 */
export function table(heads, rows) {
  const made = document.createElement("table");
  made.setAttribute("role", "table");
  const head = made.createTHead().insertRow();
  head.setAttribute("role", "row");
  for (const one of heads) {
    const cell = document.createElement("th");
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

/**
 * @param {string} className
 * @param {string} text
 */
export function span(className, text) {
  const made = document.createElement("span");
  made.className = className;
  made.textContent = text;
  return made;
}

/** @param {string} text */
export function paragraph(text) {
  const made = document.createElement("p");
  made.textContent = text;
  return made;
}
