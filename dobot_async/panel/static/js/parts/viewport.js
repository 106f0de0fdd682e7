// The picture of the cell: 3-D where the browser can, 2-D where it cannot or where that is wanted.

import { button, el, fill, say } from "../dom.js";
import { toast } from "../dialogs.js";
import { icon } from "../icons.js";
import { View2D } from "../view/view2d.js";

const KIND = "dobot-async view";
const MOVING = new Set(["state", "scene", "arms", "target", "lease"]);

export function viewport(app) {
  const { texts } = app;
  const place = el("div.canvas");
  const kind = button("", () => show(view instanceof View2D ? "3d" : "2d", true), { class: "chip" });
  const home = button(icon("reset"), () => view?.home(), { class: "icon-button", "aria-label": texts.view.home });
  const clear = button(icon("eraser"), () => {
    for (const arm of app.model.arms.values()) arm.trace = [];
    app.model.strokes = [];
    view?.update();
  }, { class: "icon-button", "aria-label": texts.view.clear });
  const element = el("section.view", { "aria-label": texts.view.label }, place, el("div.view-tools", {}, kind, home, clear));
  let view = null;
  let possible = true;
  let told = false;

  const hooks = {
    selected: () => app.arm, lead: app.follower, words: texts.view,
    lost: () => { possible = false; show("2d"); },
  };

  const show = async (wanted, keep = false) => {
    if (keep) localStorage.setItem(KIND, wanted);
    const module = wanted === "3d" && possible ? await import("../view/view3d.js").catch(() => null) : null;
    possible = wanted === "3d" ? Boolean(module?.hasWebGL()) : possible;
    view?.close();
    try {
      view = module && possible ? new module.View3D(app.model, { ...hooks, label: texts.view.canvas }) : null;
    } catch {
      possible = false;
      view = null;
    }
    view ??= new View2D(app.model, { ...hooks, label: texts.view.flat });
    fill(place, view.element);
    kind.hidden = !possible;
    say(kind, view instanceof View2D ? texts.view.three : texts.view.two);
    if (!possible && !told) toast(texts.view.noWebGL);
    told ||= !possible;
    element.dataset.kind = view instanceof View2D ? "2d" : "3d";
  };

  show(localStorage.getItem(KIND) ?? "3d");

  return {
    element,
    update(topic) {
      if (topic === "select" || topic === "theme") view?.rebuild();
      else if (MOVING.has(topic)) view?.update();
    },
  };
}
