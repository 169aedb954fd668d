// Light or dark: the system's choice, unless this browser has its own.

const KEY = "theme";

/**
 * Apply the chosen look, now and at each change; `choice` is a select of "", "light" and "dark".
 *
 * @param {HTMLSelectElement} choice
 */
export function followTheme(choice) {
  const system = matchMedia("(prefers-color-scheme: light)");
  const show = () => {
    document.documentElement.dataset.theme = choice.value || (system.matches ? "light" : "dark");
  };
  choice.value = localStorage.getItem(KEY) ?? "";
  choice.addEventListener("change", () => {
    localStorage.setItem(KEY, choice.value);
    show();
  });
  system.addEventListener("change", show);
  show();
}
