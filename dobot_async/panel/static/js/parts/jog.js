// The jog pad: buttons for each direction, held to move or pressed for one step.

import { choice, el, fill, mark, say } from "../dom.js";
import { holdable } from "../hold.js";
import { icon } from "../icons.js";
import { toast } from "../dialogs.js";

const SPEED = "dobot-async jog speed";
const CROSS = new Map([["x+", ["up", "xp"]], ["y+", ["left", "yp"]], ["y-", ["right", "ym"]], ["x-", ["down", "xm"]], ["z+", ["up", "zp"]], ["z-", ["down", "zm"]]]);
const EXPECTED = new Set(["released", "left", "stopped"]);

export function jogPart(app) {
  const { texts } = app;
  const pad = el("div.pad");
  const sizes = el("div");
  const frames = choice(texts.jog.frame, [["tool", texts.jog.tool], ["joint", texts.jog.joint]], "tool", value => { frame = value; step = null; build(); });
  const hint = el("p.hint");
  const speed = el("input", { type: "range", min: 1, max: 100, step: 1, id: "jog-speed", value: localStorage.getItem(SPEED) ?? 20, on: { input: () => speedChanged() } });
  const percent = el("output", { for: "jog-speed" });
  const speedRow = el("div.field.slider", {}, el("label", { for: "jog-speed" }, texts.jog.speed), speed, percent);
  const gate = el("fieldset.gate", {}, el("div.row", {}, frames.row, sizes), pad, speedRow, hint);
  const element = el("section.card.jog", { "aria-labelledby": "jog-title" }, el("h2", { id: "jog-title" }, texts.jog.title), gate);
  let frame = "tool";
  let step = null; // null: hold
  let press = 0;
  let bars = [];

  const speedChanged = () => {
    say(percent, `${speed.value} ${texts.jog.percent}`);
    localStorage.setItem(SPEED, speed.value);
  };
  speedChanged();

  const control = (direction, content, name) => {
    const element = el("button.jog-button", { type: "button", "data-direction": direction, "data-at": name }, content);
    const label = () => (step === null ? texts.jog.press(direction) : texts.jog.one(direction, size(direction)));
    element.setAttribute("aria-label", label());
    if (step === null) hold(element, direction);
    else element.addEventListener("click", () => app.act("step", { direction, size: step }));
    return element;
  };

  const hold = (element, direction) => {
    let arm = null;
    let number = 0;
    holdable(element, {
      ready: () => app.mine,
      start: () => {
        arm = app.arm.name;
        number = ++press;
        const { connection } = app;
        connection.request("jog", { arm, direction, press: number, tick: connection.tick, speed: Number(speed.value) })
          .catch(error => error.kind !== "stopped" && app.complain(error));
      },
      beat: () => app.connection.tell("beat", { arm, press: number, tick: app.connection.tick }),
      stop: reason => {
        app.connection.tell("release", { arm, press: number });
        if (reason === "lost") toast(texts.jog.ended(texts.jog.lost));
      },
    });
  };

  const unit = direction => (frame === "tool" && app.arm?.info.axes.find(axis => axis.name === direction.slice(0, -1))?.unit === "mm" ? "mm" : "°");
  const size = direction => `${step} ${unit(direction)}`;

  const build = () => {
    const { arm } = app;
    element.hidden = !arm?.can("jog");
    if (!arm || element.hidden) return;
    const { mm, degrees } = arm.info.steps;
    const options = [["hold", texts.jog.hold], ...(frame === "tool" ? mm : degrees).map(value => [value, `${value}`])];
    const steps = choice(`${texts.jog.step}${frame === "tool" ? " (mm, °)" : " (°)"}`, options, step ?? "hold", value => { step = value === "hold" ? null : value; build(); });
    const focused = sizes.contains(document.activeElement);
    fill(sizes, steps.row);
    if (focused) sizes.querySelector("input:checked")?.focus();
    say(hint, step === null ? texts.jog.holdHint : texts.jog.stepHint);
    speedRow.hidden = step !== null;
    fill(pad, frame === "tool" ? toolPad(arm) : jointPad(arm));
    showJoints();
  };

  const toolPad = arm => {
    bars = [];
    const words = arm.info.jog.tool;
    const cross = words.filter(word => CROSS.has(word));
    const rest = words.filter(word => !CROSS.has(word));
    const [flat, high] = [cross.filter(word => word[0] !== "z"), cross.filter(word => word[0] === "z")];
    const big = word => control(word, [icon(CROSS.get(word)[0]), el("span", {}, texts.jog.signed(word))], CROSS.get(word)[1]);
    return [
      el("div.cross", {}, flat.map(big), el("span.middle", { "aria-hidden": "true" }, "x y")),
      el("div.column", {}, high.map(big)),
      el("div.pairs", {}, rest.map(word => control(word, [icon(word.endsWith("+") ? "ccw" : "cw"), el("span", {}, texts.jog.signed(word))], "turn"))),
    ];
  };

  const jointPad = arm => {
    bars = arm.info.joints.map(joint => ({ joint, bar: el("meter", { min: joint.min, max: joint.max, "aria-label": joint.name }), value: el("span.value") }));
    return el("div.joints", {}, bars.map(({ joint, bar, value }) => {
      const [down, up] = ["-", "+"].map(way => {
        const word = `${joint.name}${way}`;
        return arm.info.jog.joint.includes(word) ? control(word, icon(way === "+" ? "plus" : "minus"), "joint") : el("span");
      });
      return el("div.joint", {}, down, el("div.where", {}, el("span.name", {}, joint.name), value, bar), up);
    }));
  };

  const showJoints = () => bars.forEach(({ bar, value }, n) => {
    const angle = app.arm?.state?.joints[n];
    if (!Number.isFinite(angle)) return;
    bar.value = angle;
    say(value, `${angle.toFixed(1).replace("-", "−")}°`);
  });

  return {
    element,
    update(topic) {
      if (topic === "select") build();
      if (topic === "state") showJoints();
      if (["select", "lease", "connection"].includes(topic)) gate.disabled = !app.mine;
      if (topic === "jog" && app.arm.jog.state === "ended" && !EXPECTED.has(app.arm.jog.why)) toast(texts.jog.ended(app.arm.jog.why), "error");
      mark(element, "data-moving", app.arm?.jog?.state === "moving" ? "yes" : false);
    },
  };
}
