// Words and numbers for people.

/**
 * Change the text only if it differs, because screen readers read changes aloud.
 *
 * @param {Element} element
 * @param {string} text
 */
export function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Compare names as people count, for a sort: scout2 is before scout10.
 *
 * @param {string} one
 * @param {string} other
 */
export function readingOrder(one, other) {
  return one.localeCompare(other, "en", { numeric: true });
}

/**
 * A time or a remaining time; empty if there is none.
 *
 * @param {number} [time_s]
 */
export function seconds(time_s) {
  return time_s === undefined || time_s < 0 ? "" : `${time_s.toFixed(1)} s`;
}

/**
 * An age, to read at a glance: " 7 s ago", " 3 min ago"; empty if it is not known.
 *
 * @param {number} [age_s]
 */
export function lasting(age_s) {
  if (age_s === undefined || age_s < 0) return "";
  return age_s < 90 ? ` ${Math.round(age_s)} s ago` : ` ${Math.round(age_s / 60)} min ago`;
}

/**
 * A name shortened to the available space; its end is kept, because names differ at their ends.
 *
 * @param {string} name
 * @param {number} room
 */
export function shortened(name, room) {
  if (name.length <= room) return name;
  if (room < 3) return "";
  return `…${name.slice(name.length - room + 1)}`;
}
