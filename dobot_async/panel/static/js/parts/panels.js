// The panels, as tabs on a phone and side by side where there is room.

import { button, el, mark } from "../dom.js";
import { icon } from "../icons.js";
import { drawPart } from "./draw.js";
import { followPart } from "./follow.js";
import { goPart } from "./goto.js";
import { jogPart } from "./jog.js";
import { statusPart } from "./status.js";
import { teachPart } from "./teach.js";
import { toolsPart } from "./tools.js";

const TAB = "dobot-async tab";
const GROUPS = [["jog", [jogPart, followPart]], ["go", [goPart]], ["tools", [toolsPart]], ["teach", [teachPart]], ["draw", [drawPart]], ["status", [statusPart]]];

export function panels(app) {
  const parts = [];
  const groups = new Map();
  for (const [name, makers] of GROUPS) {
    const made = makers.map(make => make(app));
    parts.push(...made);
    groups.set(name, el("div.group", { id: `panel-${name}`, "data-group": name }, made.map(part => part.element)));
  }

  const tabs = new Map(GROUPS.map(([name]) => [name, button([icon(name), el("span", {}, app.texts.tabs[name])], () => show(name), { "aria-controls": `panel-${name}` })]));
  const nav = el("nav.tabs", { "aria-label": app.texts.title }, [...tabs.values()]);

  const show = chosen => {
    sessionStorage.setItem(TAB, chosen);
    for (const [name, tab] of tabs) {
      mark(tab, "aria-current", name === chosen ? "page" : false);
      groups.get(name).classList.toggle("shown", name === chosen);
    }
    dispatchEvent(new Event("resize"));
  };

  document.getElementById("footer").append(nav);
  const kept = sessionStorage.getItem(TAB);
  show(tabs.has(kept) ? kept : "jog");

  return {
    element: el("div.groups", {}, [...groups.values()]),
    update(topic) {
      for (const part of parts) part.update(topic);
      if (topic === "select") tabs.get("draw").hidden = Boolean(app.arm) && !app.arm.can("draw") && !app.arm.can("engrave");
    },
  };
}
