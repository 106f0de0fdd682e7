// The stop: always in reach, no question asked, by anybody. It stops all arms, so that nobody has to think about which.

import { el, say } from "../dom.js";
import { releaseAll } from "../hold.js";
import { toast } from "../dialogs.js";

const SHOWN = 2500; // ms

export function stopBar(app) {
  const { texts } = app;
  const word = el("span.word", {}, texts.stop.one);
  const hint = el("kbd", {}, texts.stop.hint);
  const element = el("button.stop", { type: "button", id: "stop", "aria-keyshortcuts": "Escape" }, word, hint);
  const said = el("p.stopped", { role: "status" });
  let number = 0;

  const stop = async () => {
    const mine = ++number;
    releaseAll("stopped");
    element.classList.add("pressed");
    say(said, app.connection.state === "open" ? texts.stop.sending : texts.stop.pending);
    try {
      await app.connection.stop();
      if (mine === number) say(said, texts.stop.done);
    } catch (error) {
      toast(texts.stop.failed(error.message), "error");
    }
    if (mine !== number) return;
    element.classList.remove("pressed");
    setTimeout(() => mine === number && say(said, ""), SHOWN);
  };

  // The press, not the release, stops; `click` is for keys and for what screen readers send.
  element.addEventListener("pointerdown", event => { event.preventDefault(); stop(); });
  element.addEventListener("click", event => event.detail === 0 && stop());
  document.addEventListener("keydown", event => {
    if (event.key !== "Escape" || event.repeat) return;
    stop();
  }, { capture: true });
  element.addEventListener("contextmenu", event => event.preventDefault());
  app.stop = stop;

  return {
    element: el("div.stop-bar", {}, element, said),
    update(topic) {
      if (topic === "select") say(word, app.model.arms.size > 1 ? texts.stop.all : texts.stop.one);
    },
  };
}
