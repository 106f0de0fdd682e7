// The teach list: take points, put them in order, change them, play them, keep them in a file.

import { ask, confirm, toast } from "../dialogs.js";
import { button, el, field, fill, fixed, number, say } from "../dom.js";
import { icon } from "../icons.js";
import { upload } from "../upload.js";

export function teachPart(app) {
  const { texts } = app;
  const { teach } = texts;
  const list = el("ol.steps", { "aria-label": teach.title });
  const problems = el("p.verdict", { role: "status", "data-state": "bad" });
  const mode = el("select", { "aria-label": teach.mode });
  const take = button([icon("plus"), teach.take], () => app.act("teach_take", mode.value ? { mode: mode.value } : {}), { class: "primary wide" });
  const speed = number(teach.speed, "%", { min: 1, max: 100, value: 50 });
  const loops = number(teach.loops, "×", { min: 1, max: 1000, step: 1, value: 1 });
  const forever = el("input", { type: "checkbox", id: "teach-forever", on: { change: () => { loops.input.disabled = forever.checked; } } });
  const reverse = el("input", { type: "checkbox", id: "teach-reverse" });
  const play = button([icon("play"), teach.play], () => start(), { class: "primary wide" });
  const clear = button(teach.clear, async () => (await confirm(teach.clearTitle, teach.clearText, teach.clear)) && app.act("teach_clear"));
  const json = el("a.button", { download: "" }, teach.download);
  const playback = el("a.button", { download: "" }, teach.playback);
  const chosen = el("input.visually-hidden", { type: "file", accept: ".json,.playback", tabindex: -1, "aria-hidden": "true", on: { change: () => load() } });
  const open = button(teach.load, () => chosen.click());
  const check = (input, label) => el("div.field.check", {}, input, el("label", { for: input.id }, label));
  const taking = el("fieldset.gate", {}, el("div.row", {}, take, mode));
  const playing = el("fieldset.gate", {}, el("div.grid", {}, speed.row, loops.row), check(forever, teach.forever), check(reverse, teach.reverse), play, el("div.actions", {}, open, clear, chosen));
  const element = el("section.card.teach", { "aria-labelledby": "teach-title" }, el("h2", { id: "teach-title" }, teach.title), taking, list, problems, playing, el("div.actions.files", {}, json, playback));

  const start = () => {
    const [percent, times] = [speed.value(), loops.value()];
    app.work(play, teach.playing, "teach_play", { ...(percent === undefined ? {} : { speed: percent }), loops: forever.checked ? null : times ?? 1, reverse: reverse.checked });
  };

  const load = async () => {
    const [file] = chosen.files;
    chosen.value = "";
    if (!file) return;
    try {
      const read = await upload(`/recordings/${encodeURIComponent(app.selected)}`, { name: file.name }, file);
      const { ok } = await app.act("teach_load", { file: read.file });
      if (ok) toast([teach.loaded(read.steps), ...(read.remarks ?? [])].join(" "));
    } catch (error) {
      app.complain(error);
    }
  };

  const words = step => {
    const axes = step.mode === "joints" && step.joints.length ? app.arm.info.joints : app.arm.info.axes;
    const values = step.mode === "joints" && step.joints.length ? step.joints : step.pose;
    return values.map((value, n) => `${axes[n]?.name ?? ""} ${fixed(value)}`).join("  ");
  };

  const extras = step => [
    teach.modes[step.mode] ?? step.mode,
    step.suction === null || step.suction === undefined ? "" : `${teach.suction} ${step.suction ? teach.on : teach.off}`,
    step.gripper === null || step.gripper === undefined ? "" : `${teach.gripper} ${step.gripper}${Number.isFinite(step.gripper) ? " %" : ""}`,
    step.pause ? `${teach.pause} ${step.pause} s` : "",
  ].filter(Boolean).join(" · ");

  const row = (step, index, count) => {
    const act = (label, picture, pressed, disabled = false) => button(icon(picture), pressed, { class: "icon-button", "aria-label": `${label}: ${teach.point(index + 1)}`, disabled });
    return el("li", {},
      el("div.step-text", {}, el("strong", {}, step.name || teach.point(index + 1)), el("span.values", {}, words(step)), el("small", {}, extras(step))),
      el("fieldset.gate.step-actions", { disabled: !app.mine },
        act(teach.up, "up", () => move(index, index - 1), index === 0),
        act(teach.down, "down", () => move(index, index + 1), index === count - 1),
        act(teach.edit, "edit", () => edit(step, index)),
        act(teach.remove, "remove", () => app.act("teach_remove", { index }))));
  };

  const move = async (index, to) => {
    const focused = document.activeElement?.getAttribute("aria-label")?.split(":")[0];
    const { ok } = await app.act("teach_move", { index, to });
    if (ok) [...(list.children[to]?.querySelectorAll("button") ?? [])].find(each => each.getAttribute("aria-label").startsWith(focused) && !each.disabled)?.focus();
  };

  const edit = async (step, index) => {
    const select = (label, options, value) => {
      const id = `edit-${label}`;
      const input = el("select", { id }, options.map(([key, text]) => el("option", { value: key }, text)));
      input.value = value;
      return { row: el("div.field", {}, el("label", { for: id }, label), el("span.entry", {}, input)), input };
    };
    const name = field(teach.name, { value: step.name ?? "", maxlength: 60 });
    const way = select(teach.mode, modes().map(each => [each, teach.modes[each] ?? each]), step.mode);
    const pause = number(teach.pause, "s", { min: 0, step: 0.1, value: step.pause ?? 0 });
    const known = value => (value === null || value === undefined ? "leave" : String(value));
    const suction = select(teach.suction, [["leave", teach.leave], ["true", teach.on], ["false", teach.off]], known(step.suction));
    const percent = Number.isFinite(step.gripper) && ![0, 100].includes(step.gripper) ? [[String(step.gripper), `${step.gripper} %`]] : [];
    const gripper = select(teach.gripper, [["leave", teach.leave], ["0", teach.close], ["100", teach.open], ["off", teach.off], ...percent], known(step.gripper));
    const changes = await ask(teach.point(index + 1), [name.row, way.row, pause.row, suction.row, gripper.row], texts.save, () => ({
      name: name.input.value, mode: way.input.value, pause: pause.value() ?? 0,
      suction: suction.input.value === "leave" ? null : suction.input.value === "true",
      gripper: gripper.input.value === "leave" ? null : gripper.input.value === "off" ? "off" : Number(gripper.input.value),
    }));
    if (changes) app.act("teach_edit", { index, changes });
  };

  const modes = () => app.arm.recording.modes ?? [];

  const show = () => {
    const { steps, problems: found } = app.arm.recording;
    fill(list, steps.length ? steps.map((step, n) => row(step, n, steps.length)) : el("li.empty", {}, teach.empty));
    say(problems, found?.length ? `${teach.problems} ${found.join(" ")}` : "");
    play.disabled = clear.disabled = !steps.length;
    json.hidden = playback.hidden = !steps.length;
    playback.hidden ||= app.arm.info.family !== "magician";
    const usable = modes().filter(each => each !== "arc");
    if (mode.children.length !== usable.length) fill(mode, usable.map(each => el("option", { value: each }, teach.modes[each] ?? each)));
    mode.hidden = usable.length < 2;
    const path = `/recordings/${encodeURIComponent(app.selected)}`;
    json.href = `${path}.json`;
    playback.href = `${path}.playback`;
  };

  return {
    element,
    update(topic) {
      if (topic === "select") element.hidden = !app.arm?.can("teach");
      if (app.arm && ["select", "recording"].includes(topic)) show();
      if (["select", "lease", "connection", "recording"].includes(topic)) for (const gate of element.querySelectorAll(".gate")) gate.disabled = !app.mine;
    },
  };
}
