// Drop a drawing, put it where it belongs, see whether it can be reached and how long it takes, draw it.

import { button, choice, el, fill, number, say, mark } from "../dom.js";
import { upload } from "../upload.js";
import { DrawPlan } from "./draw_plan.js";

const PAUSE = 300; // ms without a change before the server is asked
const PICTURE = /\.(png|jpe?g|gif|bmp|webp)$/i;
const ACCEPT = ".svg,.dxf,.gcode,.nc,.ngc,.png,.jpg,.jpeg,.gif,.bmp";

export function drawPart(app) {
  const { texts } = app;
  const { draw } = texts;
  const chosen = el("input.visually-hidden", { type: "file", accept: ACCEPT, id: "draw-file", on: { change: () => { const [file] = chosen.files; chosen.value = ""; if (file) read(file); } } });
  const drop = el("div.drop", {}, el("p", {}, draw.drop), el("label.button", { for: "draw-file" }, draw.pick), chosen);
  const again = button(draw.another, () => chosen.click());
  const verdict = el("p.verdict", { role: "status" });
  const figures = el("p.hint");
  const fields = {
    x: number(draw.x, "mm"), y: number(draw.y, "mm"), width: number(draw.width, "mm", { min: 1 }), rotation: number(draw.rotation, "°"),
    z: number(draw.z, "mm"), lift: number(draw.lift, "mm", { min: 0, value: 20 }), press: number(draw.press, "mm", { min: 0, value: 0 }), speed: number(draw.speed, "mm/s", { min: 1 }),
  };
  const here = button(draw.here, () => { fields.z.set(app.arm.state?.pose.z); changed(); });
  const start = button(draw.start, () => begin(), { class: "primary wide" });
  const plan = new DrawPlan(draw, place => { fields.x.set(place.x); fields.y.set(place.y); fields.width.set(place.width); changed(); });
  const tools = el("div");
  const modes = el("div");
  const work = el("div", { hidden: true }, plan.element, figures, verdict,
    el("div.grid", {}, Object.values(fields).map(each => each.row)), el("div.actions", {}, here, again), tools, modes, start);
  const gate = el("fieldset.gate", {}, drop, work);
  const element = el("section.card.draw", { "aria-labelledby": "draw-title" }, el("h2", { id: "draw-title" }, draw.title), gate);
  let file = null; // what the server says of it
  let source = null; // what was dropped
  let mode = "outline";
  let tool = "pen";
  let timer = 0;
  let asked = 0;
  let outlined = null;

  for (const each of Object.values(fields)) each.input.addEventListener("input", () => changed());
  for (const type of ["dragenter", "dragover"]) element.addEventListener(type, event => { event.preventDefault(); if (app.mine) element.classList.add("over"); });
  for (const type of ["dragleave", "drop"]) element.addEventListener(type, event => { event.preventDefault(); element.classList.remove("over"); });
  element.addEventListener("drop", event => { const [dropped] = event.dataTransfer.files; if (dropped && app.mine) read(dropped); });

  const read = async dropped => {
    source = dropped;
    say(figures, draw.uploading(dropped.name));
    work.hidden = false;
    const values = { arm: app.selected, name: dropped.name, ...(PICTURE.test(dropped.name) ? { mode } : {}) };
    try {
      file = await upload("/files", values, dropped);
    } catch (error) {
      say(figures, "");
      work.hidden = !file;
      return app.complain(error);
    }
    drop.hidden = true;
    fill(modes, PICTURE.test(dropped.name) && choice(draw.mode, Object.entries(draw.modes), mode, value => { mode = value; read(source); }, { titled: true }).row);
    if (fields.width.value() === undefined) put();
    return changed();
  };

  /** Somewhere sensible at first: in the middle of what can be reached, a third of it wide. */
  const put = () => {
    const { arm } = app;
    const [x0, y0, x1, y1] = file.bounds;
    const { inner = 150, outer = 300 } = arm.info.reach ?? {};
    const size = 0.55 * (outer - inner);
    const scale = size / Math.max(x1 - x0, y1 - y0, 1);
    fields.width.set((x1 - x0) * scale || size);
    fields.rotation.set(0);
    fields.x.set((inner + outer) / 2 - ((x1 - x0) * scale) / 2);
    fields.y.set(-((y1 - y0) * scale) / 2);
    if (fields.z.value() === undefined) fields.z.set(arm.state?.pose.z);
  };

  /** How it lies, or null while a field is empty. */
  const placing = () => {
    const value = name => fields[name].value();
    const [x0, y0, x1, y1] = file.bounds;
    const width = value("width");
    const place = { x: value("x"), y: value("y"), z: value("z"), rotation: value("rotation") ?? 0, lift: value("lift") ?? 20, press: value("press") ?? 0 };
    if (![place.x, place.y, place.z, place.rotation, place.lift, place.press, width].every(Number.isFinite) || width <= 0) return null;
    return { plane: place, size: [width, x1 > x0 ? (width * (y1 - y0)) / (x1 - x0) : y1 - y0] };
  };

  const changed = () => {
    if (!file || !app.arm) return;
    clearTimeout(timer);
    const placed = placing();
    start.disabled = true;
    say(figures, [file.name, draw.figures(file.strokes, file.length)].join(" · "));
    if (!placed) return show(texts.go.number, "bad");
    plan.show(app.arm, file, placed);
    say(verdict, draw.checking);
    mark(verdict, "data-state", false);
    timer = setTimeout(() => look(placed), PAUSE);
  };

  const show = (text, state) => {
    say(verdict, text);
    mark(verdict, "data-state", state);
  };

  /** Ask what the arm makes of it. */
  const look = async placed => {
    const number = ++asked;
    const { arm } = app;
    if (outlined !== placed.plane.z) {
      const { ok, value } = await app.act("outline", { z: placed.plane.z }, { quiet: true });
      outlined = ok ? placed.plane.z : null;
      plan.reach(ok ? value.rings : []);
    }
    const { ok, value, error } = await app.act("preview", { file: file.file, ...placed }, { quiet: true });
    if (number !== asked || arm !== app.arm) return;
    if (!ok) return show(error.message, "bad");
    arm.drawing = value.lines.map(line => line.map(point => (point.length > 2 ? point : [...point, placed.plane.z])));
    app.update("target");
    say(figures, [file.name, draw.figures(value.strokes, value.length), Number.isFinite(value.seconds) ? draw.time(value.seconds) : ""].filter(Boolean).join(" · "));
    const bad = value.problems.length > 0;
    show(bad ? value.problems.join(" ") : draw.fine, bad ? "bad" : "ok");
    start.disabled = bad;
  };

  const begin = async () => {
    const speed = fields.speed.value();
    await app.work(start, draw.busy, "draw", { file: file.file, ...placing(), tool, ...(speed ? { speed } : {}) });
    changed();
  };

  const build = () => {
    const { arm } = app;
    element.hidden = !arm?.can("draw") && !arm?.can("engrave");
    if (!arm) return;
    const both = arm.can("draw") && arm.can("engrave");
    tool = arm.can("draw") ? "pen" : "laser";
    fill(tools, both && choice(draw.tool, [["pen", draw.pen], ["laser", draw.laser]], tool, value => { tool = value; }, { titled: true }).row);
    outlined = file = null;
    fields.width.set();
    drop.hidden = false;
    work.hidden = true;
  };

  addEventListener("resize", () => plan.draw());

  return {
    element,
    update(topic) {
      if (topic === "select") build();
      if (topic === "theme") plan.draw();
      if (["select", "lease", "connection"].includes(topic)) gate.disabled = !app.mine;
    },
  };
}
