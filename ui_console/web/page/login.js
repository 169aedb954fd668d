// Login: the token comes with the address or from a form, and is kept for this tab only.

import { find } from "./dom.js";
import { remembered } from "./memory.js";
import { set } from "./text.js";

/** Calls `enter({token, user})` as soon as there is a token to try. */
export class Login {
  /** @param {{ form: HTMLFormElement, enter: (hello: { token: string, user: string }) => void }} given */
  constructor({ form, enter }) {
    this.form = form;
    this.enter = enter;
    this.token = find("login-token", HTMLInputElement);
    this.user = find("login-user", HTMLInputElement);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      remember(this.token.value.trim(), this.user.value.trim());
      location.reload(); // what the page shows may be of another mission
    });
  }

  begin() {
    addEventListener("hashchange", () => {
      if (location.hash.includes("token=")) location.reload(); // an address was opened where its page is open
    });
    const given = new URLSearchParams(location.hash.slice(1));
    const [newToken, newUser] = [given.get("token"), given.get("user")];
    if (newToken !== null) {
      sessionStorage.setItem(remembered("token"), newToken);
      if (newUser !== null) sessionStorage.setItem(remembered("user"), newUser);
      history.replaceState(null, "", location.pathname); // so that no picture of the screen shows the token
    }
    const token = sessionStorage.getItem(remembered("token"));
    if (token) this.try(token, sessionStorage.getItem(remembered("user")) ?? "");
    else this.ask("");
  }

  /** @param {string} why */
  ask(why) {
    sessionStorage.removeItem(remembered("token"));
    set(find("login-why"), why);
    this.form.hidden = false;
    this.token.focus();
  }

  /**
   * @param {string} token
   * @param {string} user
   */
  try(token, user) {
    this.form.hidden = true;
    this.enter({ token, user });
  }
}

/**
 * @param {string} token
 * @param {string} user
 */
function remember(token, user) {
  sessionStorage.setItem(remembered("token"), token);
  sessionStorage.setItem(remembered("user"), user);
}
