// What a tab remembers, by mission: each of a server's missions has a page with a path of its own.

/**
 * The name under which this tab remembers something of this mission alone.
 *
 * @param {string} what
 */
export function remembered(what) {
  return location.pathname === "/" ? what : `${what} of ${location.pathname}`;
}
