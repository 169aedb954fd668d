// Who is there: the token comes with the address or is asked for, and is kept for this tab only.

/** Calls `enter({token, user})` as soon as there is a token to try. */
export class Login {
  constructor({ form, enter }) {
    this.form = form;
    this.enter = enter;
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.try(form.elements.token.value.trim(), form.elements.user.value.trim());
    });
  }

  begin() {
    const given = new URLSearchParams(location.hash.slice(1));
    if (given.has("token")) {
      sessionStorage.setItem("token", given.get("token"));
      if (given.has("user")) sessionStorage.setItem("user", given.get("user"));
      history.replaceState(null, "", location.pathname); // so that no picture of the screen shows the token
    }
    const token = sessionStorage.getItem("token");
    if (token) this.try(token, sessionStorage.getItem("user") ?? "");
    else this.ask("");
  }

  ask(why) {
    sessionStorage.removeItem("token");
    this.form.querySelector("[role=alert]").textContent = why;
    this.form.hidden = false;
    this.form.elements.token.focus();
  }

  try(token, user) {
    sessionStorage.setItem("token", token);
    sessionStorage.setItem("user", user);
    this.form.hidden = true;
    this.enter({ token, user });
  }
}
