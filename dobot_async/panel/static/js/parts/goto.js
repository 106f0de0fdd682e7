// Move to typed coordinates or joint angles, looked at before anything is sent.

import { button, choice, el, fill, mark, number, say } from "../dom.js";

const PAUSE = 250; // ms without a key before a position is checked

export function goPart(app) {
  const { texts } = app;
  const inputs = el("div.grid");
  const verdict = el("p.verdict", { role: "status" });
  const line = el("input", { type: "checkbox", id: "go-line" });
  const lineRow = el("div.field.check", {}, line, el("label", { for: "go-line" }, texts.go.line));
  const move = button(texts.go.move, () => go(), { class: "primary" });
  const here = button(texts.go.here, () => takeHere());
  const kinds = choice(texts.go.title, [["pose", texts.go.pose], ["joints", texts.go.joints]], "pose", value => { kind = value; build(); });
  const gate = el("fieldset.gate", {}, kinds.row, inputs, lineRow, verdict, el("div.actions", {}, here, move));
  const element = el("section.card.go", { "aria-labelledby": "go-title" }, el("h2", { id: "go-title" }, texts.go.title), gate);
  let kind = "pose";
  let fields = [];
  let timer = 0;
  let asked = 0;

  const build = () => {
    const { arm } = app;
    element.hidden = !arm?.can("move_to");
    if (!arm) return;
    const pose = kind === "pose";
    const of = pose ? arm.info.axes.map(axis => ({ ...axis, unit: axis.unit === "mm" ? "mm" : "°" })) : arm.info.joints.map(joint => ({ ...joint, unit: "°" }));
    fields = of.map(each => {
      const made = number(each.name, each.unit, { min: each.min, max: each.max, "data-axis": each.name });
      made.input.addEventListener("input", () => changed());
      made.input.addEventListener("keydown", event => event.key === "Enter" && !move.disabled && go());
      return { name: each.name, ...made };
    });
    fill(inputs, fields.map(each => each.row));
    lineRow.hidden = !pose;
    kinds.row.hidden = !arm.can("move_joints");
    changed();
  };

  const takeHere = () => {
    const state = app.arm?.state;
    if (!state) return;
    fields.forEach((each, n) => each.set(kind === "pose" ? state.pose[each.name] : state.joints[n]));
    changed();
  };

  /** What is typed; null while it is not a whole position. */
  const typed = () => {
    const values = fields.map(each => each.value());
    if (values.some(Number.isNaN)) return null;
    if (kind === "joints") return values.every(value => value !== undefined) ? { joints: values } : null;
    const given = Object.fromEntries(fields.map((each, n) => [each.name, values[n]]).filter(([, value]) => value !== undefined));
    return Object.keys(given).length ? given : null;
  };

  const show = (text, state) => {
    say(verdict, text);
    mark(verdict, "data-state", state);
    move.disabled = state !== "ok";
  };

  const changed = () => {
    clearTimeout(timer);
    const wanted = typed();
    const pose = app.arm?.state?.pose;
    const target = wanted && kind === "pose" && ["x", "y", "z"].map(axis => wanted[axis] ?? pose?.[axis]);
    if (app.arm) app.arm.target = target && target.every(Number.isFinite) ? target : null;
    app.update("target");
    if (!wanted) return show(fields.some(each => Number.isNaN(each.value())) ? texts.go.number : texts.go.empty, false);
    if (!app.arm.can("check")) return show("", "ok");
    show(texts.go.checking, false);
    const number = ++asked;
    timer = setTimeout(async () => {
      const { ok, value, error } = await app.act("check", wanted, { quiet: true });
      if (number !== asked) return;
      if (!ok) show(error.message, "bad");
      else show(value.ok ? texts.go.ok : value.problem, value.ok ? "ok" : "bad");
    }, PAUSE);
    return undefined;
  };

  const go = async () => {
    const wanted = typed();
    if (!wanted) return;
    const { arm } = app;
    await (kind === "pose" ? app.work(move, texts.go.busy, "move_to", { ...wanted, line: line.checked }) : app.work(move, texts.go.busy, "move_joints", wanted));
    if (arm === app.arm) changed();
  };

  return {
    element,
    update(topic) {
      if (topic === "select") build();
      if (["select", "lease", "connection"].includes(topic)) gate.disabled = !app.mine;
    },
  };
}
