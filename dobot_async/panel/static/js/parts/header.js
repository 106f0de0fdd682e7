// The head: which arm, how its link is, who controls it, the theme.

import { button, el, fill, mark, say } from "../dom.js";
import { icon } from "../icons.js";

const THEME = "dobot-async theme";

export function header(app) {
  const { texts } = app;
  const picker = el("select", { "aria-label": texts.arm.label, on: { change: () => app.select(picker.value) } });
  const name = el("h1");
  const dot = el("span.dot", { "aria-hidden": "true" });
  const state = el("span");
  const trip = el("span.trip");
  const link = el("p.link", { "aria-label": texts.link.label }, dot, state, trip);
  const lease = button("", () => (app.mine ? app.act("release_lease") : app.takeLease()), { id: "lease" });
  const theme = themeButton(app);
  const element = el("div.bar", {}, el("div.which", {}, name, picker, link), lease, theme);

  const showArms = () => {
    const names = [...app.model.arms.keys()];
    const several = names.length > 1;
    picker.hidden = !several;
    name.hidden = several;
    fill(picker, names.map(each => el("option", { value: each }, each)));
    picker.value = app.selected;
    say(name, app.arm?.info.title ?? texts.title);
  };

  const showLink = () => {
    const { state: open } = app.connection;
    const known = open === "open" && app.arm ? app.arm.link : null;
    mark(dot, "data-state", known?.state ?? open);
    say(state, known ? texts.link[known.state] : open === "connecting" ? texts.connection.connecting : texts.link.lost);
    const simulated = app.arm?.info.simulated ? texts.arm.simulated : "";
    say(trip, [known?.state === "open" && Number.isFinite(known.round_trip) ? texts.link.trip(known.round_trip) : "", simulated].filter(Boolean).join(" · "));
  };

  const showLease = () => {
    lease.hidden = !app.operator || !app.arm;
    lease.disabled = app.connection.state !== "open";
    mark(lease, "class", app.mine ? "quiet" : "primary");
    say(lease, app.mine ? texts.lease.release : texts.lease.take);
  };

  return {
    element,
    update(topic) {
      if (topic === "select") showArms();
      if (["select", "link", "connection"].includes(topic)) showLink();
      if (["select", "lease", "connection"].includes(topic)) showLease();
    },
  };
}

/** The theme is what the system has, until somebody chooses. */
function themeButton(app) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const root = document.documentElement;
  const show = () => {
    const kept = localStorage.getItem(THEME);
    root.dataset.theme = kept === "dark" || kept === "light" ? kept : system.matches ? "dark" : "light";
    const dark = root.dataset.theme === "dark";
    fill(element, icon(dark ? "sun" : "moon"));
    element.setAttribute("aria-label", dark ? app.texts.theme.light : app.texts.theme.dark);
    app.update("theme");
  };
  const element = button("", () => {
    localStorage.setItem(THEME, root.dataset.theme === "dark" ? "light" : "dark");
    show();
  }, { class: "icon-button" });
  system.addEventListener("change", show);
  show();
  return element;
}
