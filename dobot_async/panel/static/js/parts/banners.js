// What everybody has to see: no connection, alarms, who controls the arm.

import { button, el, fill, say } from "../dom.js";
import { icon } from "../icons.js";
import { toast } from "../dialogs.js";

const SOON = 2000; // ms; who takes control so soon after it was lost has taken it from us

/** A name in capitals, as manuals have it, in words: JOINT_LIMIT is "Joint limit". */
function inWords(name) {
  return /^[A-Z0-9_]+$/.test(name) ? name[0] + name.slice(1).toLowerCase().replaceAll("_", " ") : name;
}

export function banners(app) {
  const { texts } = app;
  const line = el("p.banner.bad", { role: "alert", hidden: true });
  const alarms = el("div", { role: "alert" });
  const lease = el("p.banner", { role: "status", hidden: true });
  const element = el("div.banners", {}, line, alarms, lease);
  let before = { arm: "", mine: false, lost: -Infinity };

  const showConnection = () => {
    const { state } = app.connection;
    line.hidden = state === "open" || (state === "connecting" && !app.model.arms.size);
    if (!line.hidden) say(line, texts.connection[state]);
  };

  const words = ({ name, cause, remedy }) => el("div", {},
    el("h2", {}, inWords(name)), cause && el("p", {}, cause), remedy && el("p", {}, el("strong", {}, `${texts.alarms.remedy}: `), remedy));

  const showAlarms = () => {
    const found = (app.arm?.alarms ?? []).filter(alarm => !alarm.harmless);
    const recover = button(texts.alarms.recover, () => app.work(recover, texts.alarms.recovering, "recover"), { class: "primary" });
    fill(alarms, found.length > 0 && el("section.banner.bad.alarms", { "aria-label": texts.alarms.title },
      icon("alarm"), el("div", {}, found.map(words)),
      app.arm.can("recover") && el("fieldset.gate", { disabled: !app.mine }, recover)));
  };

  const showLease = () => {
    const { arm } = app;
    const holder = arm?.lease.holder;
    const words = !arm ? "" : app.mine ? "" : holder ? texts.lease.held(holder) : app.operator ? texts.lease.needed : "";
    say(lease, [words, app.operator ? "" : texts.lease.viewer].filter(Boolean).join(". ").replace("..", "."));
    lease.hidden = app.connection.state !== "open" || !lease.textContent;
    const lost = before.arm === arm?.name && before.mine && !app.mine && app.connection.state === "open";
    if (lost && !holder) toast(texts.lease.ended, "error");
    if (holder && !app.mine && (lost || performance.now() - before.lost < SOON)) toast(texts.lease.lostTo(holder), "error");
    before = { arm: arm?.name, mine: app.mine, lost: lost && !holder ? performance.now() : -Infinity };
  };

  return {
    element,
    update(topic) {
      if (["select", "connection"].includes(topic)) showConnection();
      if (["select", "alarms", "lease"].includes(topic)) showAlarms();
      if (["select", "lease", "connection"].includes(topic)) showLease();
    },
  };
}
