// Light or dark: as the system has it, unless this browser was told otherwise.

const KEY = "theme";

/**
 * Have the page look as chosen, now and whenever that changes; `choice` is a select of "", "light" and "dark".
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
