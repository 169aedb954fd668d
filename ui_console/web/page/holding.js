// A button that acts only after it was held for a second, by pointer or Enter, so that a double press never lifts a
// stop.

export const HOLD_MS = 1000; // chosen: longer than any double press, short enough for a person who means it

/**
 * Call `act` when the button has been held; any other event releases it. Space never holds, because it stops robots.
 *
 * @param {HTMLButtonElement} button
 * @param {() => void} act
 */
export function actWhenHeld(button, act) {
  /** @type {ReturnType<typeof setTimeout> | 0} */
  let timer = 0;
  const drop = () => {
    clearTimeout(timer);
    timer = 0;
    button.classList.remove("is-held");
  };
  const hold = () => {
    if (timer !== 0 || button.disabled) return;
    button.classList.add("is-held");
    timer = setTimeout(() => {
      drop();
      act();
    }, HOLD_MS);
  };
  button.addEventListener("pointerdown", (event) => {
    if (event.isPrimary && event.button === 0) hold();
  });
  button.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") {
      drop();
      return;
    }
    event.preventDefault();
    if (!event.repeat) hold();
  });
  for (const end of ["pointerup", "pointerleave", "pointercancel", "keyup", "blur"]) button.addEventListener(end, drop);
  button.addEventListener("contextmenu", (event) => event.preventDefault()); // a finger that rests asks for one
  addEventListener("blur", drop);
  document.addEventListener("visibilitychange", drop);
  return drop;
}
