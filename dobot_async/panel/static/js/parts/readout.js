// Where the arm is and what it is doing, beside the picture: pose, joints, the running command, home, pause.

import { button, el, fill, fixed, mark, say } from "../dom.js";
import { icon } from "../icons.js";

export function readout(app) {
  const { texts } = app;
  const pose = el("dl.numbers", { "aria-label": texts.pose.label });
  const joints = el("dl.numbers.joints", { "aria-label": texts.pose.joints });
  const figures = el("div.figures", {}, pose, joints);
  const moving = el("span.moving");
  const doing = el("span.doing");
  const bar = el("progress", { max: 1, hidden: true, "aria-label": texts.queue.running });
  const home = button([icon("home"), texts.home.label], () => app.work(home, texts.home.busy, "home"));
  const pause = button([icon("pause"), texts.pause], () => app.act("pause"));
  const resume = button([icon("play"), texts.resume], () => app.act("resume"));
  const power = button([icon("power"), texts.power], () => app.act("power"));
  const gate = el("fieldset.gate.actions", { "aria-label": texts.title }, home, pause, resume, power);
  const element = el("section.readout", { "aria-label": texts.pose.label }, figures, el("div.activity", {}, moving, doing, bar), gate);
  let cells = [];

  const build = () => {
    const { arm } = app;
    home.hidden = !arm?.can("home");
    pause.hidden = resume.hidden = !arm?.can("pause");
    power.hidden = !arm?.can("power");
    cells = [];
    const cell = (read, name) => {
      const value = el("dd");
      cells.push([read, value]);
      return el("div", {}, el("dt", {}, name), value);
    };
    fill(pose, (arm?.info.axes ?? []).map(axis => cell(state => state.pose[axis.name], axis.name)));
    fill(joints, (arm?.info.joints ?? []).map((joint, n) => cell(state => state.joints[n], joint.name)));
    for (const list of [pose, joints]) list.classList.toggle("many", list.children.length > 4);
    numbers();
  };

  const numbers = () => {
    const state = app.arm?.state;
    for (const [read, value] of cells) say(value, fixed(state ? read(state) : undefined));
    const stale = app.connection.state !== "open";
    mark(figures, "data-stale", stale && state ? "yes" : false);
    const words = stale && state ? texts.pose.stale : !state ? texts.pose.unknown : state.moving === null || state.moving === undefined ? "" : state.moving ? texts.pose.moving : texts.pose.rests;
    say(moving, words);
    mark(moving, "data-moving", state?.moving && !stale ? "yes" : false);
  };

  const activity = () => {
    const running = app.connection.state === "open" && app.arm?.queue.items.find(item => item.state === "running");
    say(doing, running ? [running.text, Number.isFinite(running.seconds_left) ? texts.queue.left(running.seconds_left) : ""].filter(Boolean).join(" · ") : "");
    bar.hidden = !Number.isFinite(running?.progress);
    if (!bar.hidden) bar.value = running.progress;
  };

  return {
    element,
    update(topic) {
      if (topic === "select") build();
      if (topic === "state" || topic === "connection") numbers();
      if (["queue", "select", "connection"].includes(topic)) activity();
      if (["select", "lease", "connection"].includes(topic)) gate.disabled = !app.mine;
    },
  };
}
