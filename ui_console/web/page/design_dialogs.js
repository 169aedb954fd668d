// Questions: one dialog to answer, one to choose, one to read. Each is a promise; null means that nothing was chosen.

const find = (id) => document.getElementById(id);

/**
 * Ask for each of `asks` ({name, doc, proposed, choices, is_required}); resolves to the answers in their order, or null.
 * `refused` says why earlier answers were not taken.
 */
export function ask(title, doc, asks, refused = "") {
  const dialog = find("ask"),
    form = dialog.querySelector("form");
  find("ask-title").textContent = title;
  find("ask-doc").textContent = doc;
  find("ask-refused").textContent = refused;
  const fields = asks.map((asked, number) => field(asked, `answer-${number}`));
  find("ask-fields").replaceChildren(...fields.map((one) => one.label));
  const cancel = form.querySelector("button[value=cancel]");
  return new Promise((resolve) => {
    const close = (answers) => {
      dialog.onclose = form.onsubmit = cancel.onclick = null;
      dialog.close();
      resolve(answers);
    };
    form.onsubmit = (event) => {
      event.preventDefault();
      close(fields.map((one) => one.input.value));
    };
    cancel.onclick = () => close(null);
    dialog.onclose = () => close(null);
    dialog.showModal();
    (fields[0]?.input ?? form.querySelector("button[value=done]")).focus();
    fields[0]?.input.select?.();
  });
}

/** Let one of `options` ({label, doc}) be chosen; resolves to it, or null. */
export function choose(title, options) {
  const dialog = find("choose"),
    filter = find("choose-find"),
    list = find("choose-list");
  find("choose-title").textContent = title;
  filter.value = "";
  return new Promise((resolve) => {
    const close = (option) => {
      dialog.onclose = filter.oninput = filter.onkeydown = null;
      dialog.close();
      resolve(option);
    };
    const fill = () => {
      const part = filter.value.trim().toLowerCase();
      const shown = options.filter((one) => one.label.toLowerCase().includes(part));
      list.replaceChildren(
        ...shown.map((one) => {
          const item = document.createElement("li"),
            button = document.createElement("button"),
            doc = document.createElement("span");
          button.type = "button";
          button.textContent = one.label;
          button.onclick = () => close(one);
          doc.className = "quiet";
          doc.textContent = one.doc;
          item.append(button, doc);
          return item;
        }),
      );
    };
    filter.oninput = fill;
    filter.onkeydown = (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      list.querySelector("button")?.click();
    };
    dialog.onclose = () => close(null);
    fill();
    dialog.showModal();
    filter.focus();
  });
}

/** Show a text, from a line on. */
export function read(title, text, line = 1) {
  find("reading-title").textContent = title;
  const shown = find("reading-text");
  shown.textContent = text;
  find("reading").showModal();
  shown.scrollTop = (shown.scrollHeight * (line - 1)) / Math.max(1, text.split("\n").length);
}

/** A labelled input, or a select where the answers can be listed; Enter in either is the form's. */
function field(asked, id) {
  const label = document.createElement("label"),
    name = document.createElement("span"),
    doc = document.createElement("span");
  const input = asked.choices.length ? document.createElement("select") : document.createElement("input");
  input.append(...asked.choices.map((one) => new Option(one, one)));
  input.id = id;
  input.name = asked.name;
  input.value = asked.proposed;
  input.required = asked.is_required;
  input.autocomplete = "off";
  if (asked.choices.length) {
    input.addEventListener("keydown", (event) => {
      if (event.key === "Enter") {
        event.preventDefault();
        input.form.requestSubmit();
      }
    });
  }
  name.textContent = asked.name;
  doc.className = "quiet";
  doc.textContent = asked.doc;
  label.append(name, input, doc);
  return { label, input };
}
