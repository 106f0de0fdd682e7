// End effectors and what else can be switched: suction, gripper, laser, conveyor, rail, pins, speed.

import { button, el, fill, mark, number, say } from "../dom.js";
import { holdable } from "../hold.js";

const ARMING = 800; // ms that the button of the laser is held

/** A switch that shows what the arm says, not what was pressed. */
function toggle(label, changed, words) {
  const state = el("span.switch-state");
  const element = el("button.switch", { type: "button", role: "switch", "aria-checked": "false", on: { click: () => changed(element.getAttribute("aria-checked") !== "true") } },
    el("span", {}, label), state, el("span.knob", { "aria-hidden": "true" }));
  return {
    element,
    show(on) {
      mark(element, "aria-checked", on === true ? "true" : "false");
      say(state, on === true ? words.on : on === false ? words.off : words.unknown);
    },
  };
}

function slider(label, unit, properties, done) {
  const id = `slider-${properties.id}`;
  const figure = el("output", { for: id });
  const input = el("input", { type: "range", ...properties, id, on: { input: () => show(), change: () => done?.(Number(input.value)) } });
  const show = () => say(figure, `${input.value} ${unit}`);
  show();
  return { row: el("div.field.slider", {}, el("label", { for: id }, label), input, figure), input, set: value => { if (document.activeElement !== input) { input.value = value; show(); } } };
}

const CARDS = [["effector", ["end_effector", "suction", "gripper", "gripper_to"]], ["laser", ["laser"]], ["conveyor", ["conveyor"]], ["rail", ["rail"]], ["pins", ["outputs", "inputs"]], ["speed", ["move_to"]]];

const MAKERS = {
  end_effector(app, { tools }) {
    const names = Object.entries(tools.onArmNames);
    const select = el("select", { id: "end-effector", on: { change: () => select.value && app.act("end_effector", { tool: select.value }) } },
      [["", tools.notSaid], ...names].map(([value, name]) => el("option", { value }, name)));
    return { elements: [el("div.field", {}, el("label", { for: select.id }, tools.onArm), el("span.entry", {}, select))], show: () => {} };
  },
  suction(app, { tools, words }) {
    const on = toggle(tools.suction, value => app.act("suction", { on: value }), words);
    return { elements: [on.element], show: io => on.show(io.suction) };
  },
  gripper(app, { tools }) {
    const words = { on: tools.closed, off: tools.open, unknown: tools.unknown };
    const closed = toggle(tools.gripper, value => app.act("gripper", { closed: value }), words);
    return { elements: [closed.element], show: io => closed.show(Number.isFinite(io.gripper) ? io.gripper < 50 : null) };
  },
  gripper_to(app, { tools }) {
    const opening = slider(tools.percent, "%", { id: "gripper", min: 0, max: 100, step: 1, value: 100 }, percent => app.act("gripper_to", { percent }));
    return { elements: [opening.row], show: io => Number.isFinite(io.gripper) && opening.set(io.gripper) };
  },
  laser,
  conveyor(app, { tools }) {
    const speed = slider(tools.belt, tools.pulses, { id: "belt", min: -15000, max: 15000, step: 500, value: 5000 });
    const motor = el("select", { "aria-label": tools.motor }, [0, 1].map(n => el("option", { value: n }, `${tools.motor} ${n + 1}`)));
    const run = value => app.act("conveyor", { speed: value, motor: Number(motor.value) });
    const state = el("p.hint", { role: "status" });
    return {
      elements: [speed.row, el("div.actions", {}, motor, button(tools.stopBelt, () => run(0)), button(tools.run, () => run(Number(speed.input.value)), { class: "primary" })), state],
      show: io => say(state, Number.isFinite(io.conveyor) ? `${io.conveyor} ${tools.pulses}` : ""),
    };
  },
  rail(app, { tools, words }) {
    const there = toggle(tools.railOn, on => app.act("rail", { on }), words);
    const to = number(tools.railTo, "mm");
    const drive = button(tools.drive, () => app.work(drive, app.texts.go.busy, "move_rail", { mm: to.value() }), { class: "primary" });
    return { elements: [there.element, el("div.row", {}, to.row, drive)], show: io => { there.show(Number.isFinite(io.rail)); to.input.placeholder = Number.isFinite(io.rail) ? io.rail.toFixed(1) : ""; } };
  },
  move_to(app, { tools }) {
    const speed = slider(tools.motions, "%", { id: "speed", min: 1, max: 100, step: 1, value: 50 }, percent => app.act("speed", { percent }));
    return { elements: [speed.row], show: () => {} };
  },
  outputs: (app, context) => pins(app, context, "output"),
  inputs: (app, context) => pins(app, context, "input"),
};

function laser(app, { tools, words }) {
  const seconds = slider(tools.armFor, tools.seconds, { id: "laser", min: 1, max: 60, step: 1, value: 10 });
  const arm = el("button.arming", { type: "button" }, el("span", {}, tools.arm));
  const on = toggle(tools.laserOn, value => app.act("laser", { on: value }), words);
  const state = el("p.hint", { role: "status" });
  let timer = 0;
  let until = 0;
  holdable(arm, {
    start: () => { timer = setTimeout(() => app.act("arm_laser", { seconds: Number(seconds.input.value) }), ARMING); },
    beat: () => {},
    stop: () => clearTimeout(timer),
  });
  const show = () => {
    const left = Math.max(0, (until - performance.now()) / 1000);
    say(state, left ? tools.armed(left) : tools.disarmed);
    on.element.disabled = !left && on.element.getAttribute("aria-checked") !== "true";
  };
  const counting = setInterval(show, 500);
  return {
    elements: [el("p.hint", {}, tools.laserHint), seconds.row, arm, on.element, state],
    show: io => { until = performance.now() + 1000 * (io.armed || 0); on.show(io.laser); show(); },
    close: () => clearInterval(counting),
  };
}

/** Outputs to be switched, or inputs to be looked at; a pin has to be told first what it is. */
function pins(app, { tools, words }, kind) {
  const { pins: each } = app.arm.info;
  const [list, numbers] = kind === "output" ? ["outputs", each.outputs] : ["inputs", each.inputs];
  const place = el("div.pins");
  const choose = el("select", { "aria-label": tools.pin }, numbers.map(n => el("option", { value: n }, `${tools.pin} ${n}`)));
  const add = button(kind === "output" ? tools.configureOut : tools.configureIn, async () => {
    const pin = Number(choose.value);
    const { ok } = await app.act("configure_pin", { pin, use: kind });
    if (ok && kind === "input") app.act("watch_inputs", { pins: [...new Set([...Object.keys(app.arm.io.inputs ?? {}).map(Number), pin])] });
  });
  const shown = new Map();
  const show = io => {
    const levels = io[list] ?? {};
    for (const pin of shown.keys()) if (!(pin in levels)) shown.delete(pin);
    for (const pin of Object.keys(levels)) {
      if (shown.has(pin)) continue;
      if (kind === "output") shown.set(pin, toggle(tools.output(pin), level => app.act("output", { pin: Number(pin), level }), words));
      else shown.set(pin, lamp(tools.input(pin), tools));
    }
    if (place.children.length !== shown.size) fill(place, [...shown.values()].map(one => one.element));
    for (const [pin, one] of shown) one.show(levels[pin]);
  };
  return { elements: [place, numbers.length && el("div.actions", {}, choose, add)], show };
}

function lamp(label, tools) {
  const state = el("span");
  const element = el("p.lamp", {}, el("span", {}, label), state);
  return { element, show: level => { mark(element, "data-on", level ? "yes" : false); say(state, level === null ? tools.unknown : level ? tools.high : tools.low); } };
}

export function toolsPart(app) {
  const { tools } = app.texts;
  const words = { on: tools.on, off: tools.off, unknown: tools.unknown };
  const element = el("div.cards");
  let made = [];
  let gates = [];

  const card = (title, elements) => {
    const gate = el("fieldset.gate", {}, elements);
    gates.push(gate);
    return el("section.card", { "aria-label": title }, el("h2", {}, title), gate);
  };

  const build = () => {
    for (const each of made) each.close?.();
    [made, gates] = [[], []];
    const cards = [];
    for (const [title, features] of CARDS) {
      const ones = features.filter(name => app.arm?.can(name)).map(name => MAKERS[name](app, { tools, words }));
      made.push(...ones);
      if (ones.length) cards.push(card(tools[title], ones.flatMap(one => one.elements)));
    }
    fill(element, cards.length ? cards : el("p.hint", {}, tools.none));
    show();
  };

  const show = () => { for (const one of made) one.show(app.arm.io); };

  return {
    element,
    update(topic) {
      if (topic === "select") build();
      if (topic === "io") show();
      if (["select", "lease", "connection"].includes(topic)) for (const gate of gates) gate.disabled = !app.mine;
    },
  };
}
