// Short notes, and questions that wait for an answer.

import { button, el } from "./dom.js";
import { texts } from "./texts.js";

const SHOWN = { error: 9000, info: 4000 }; // ms
const MOST = 3;

/** Show a note for some seconds; screen readers read it. */
export function toast(text, kind = "info") {
  const place = document.getElementById("toasts");
  for (const each of [...place.children]) if (each.dataset.text === text) each.remove();
  const note = el(`div.toast.${kind}`, { "data-text": text }, el("span", {}, text), button("×", () => note.remove(), { "aria-label": texts.dismiss }));
  place.append(note);
  while (place.children.length > MOST) place.firstChild.remove();
  setTimeout(() => note.remove(), SHOWN[kind]);
}

/**
 * Show a dialog; the promise is what `result` returns if it is confirmed, null if it is not.
 *
 * It is not a modal one: the browser would then keep every press from the stop button. Its curtain covers all but that.
 */
export function ask(title, content, action, result) {
  return new Promise(resolve => {
    const before = document.activeElement;
    const form = el("form", { method: "dialog" },
      el("h2", {}, title), content,
      el("div.actions", {}, button(texts.cancel, () => dialog.close()), el("button.primary", { value: "yes" }, action)));
    const dialog = el("dialog", { "aria-label": title, on: {
      close: () => {
        resolve(dialog.returnValue === "yes" ? result() : null);
        covered(false);
        curtain.remove();
        before?.focus?.();
      },
      keydown: event => event.key === "Escape" && dialog.close(),
    } }, form);
    const curtain = el("div.curtain", {}, dialog);
    document.body.append(curtain);
    covered(true);
    dialog.show();
  });
}

/** What lies below a curtain can neither be pressed nor reached by keys. */
function covered(yes) {
  for (const id of ["header", "banners", "main"]) document.getElementById(id).inert = yes;
}

/** Ask whether to do something. */
export const confirm = async (title, text, action) => (await ask(title, el("p", {}, text), action, () => true)) === true;
