// Words and numbers for people.

/**
 * Change the text only if it is another: screen readers say what changes.
 *
 * @param {Element} element
 * @param {string} text
 */
export function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * A time or a rest; nothing if there is none.
 *
 * @param {number} [time_s]
 */
export function seconds(time_s) {
  return time_s === undefined || time_s < 0 ? "" : `${time_s.toFixed(1)} s`;
}

/**
 * For how long, to read at a glance: " 7 s ago", " 3 min ago"; nothing if that is not known.
 *
 * @param {number} [age_s]
 */
export function lasting(age_s) {
  if (age_s === undefined || age_s < 0) return "";
  return age_s < 90 ? ` ${Math.round(age_s)} s ago` : ` ${Math.round(age_s / 60)} min ago`;
}

/**
 * So much of a name as there is room for: names differ at their ends, so those are kept.
 *
 * @param {string} name
 * @param {number} room
 */
export function shortened(name, room) {
  if (name.length <= room) return name;
  if (room < 3) return "";
  return `…${name.slice(name.length - room + 1)}`;
}
