// Following: a touch pad, a strip for the height, dragging in the picture, a gamepad.

import { el, mark, say } from "../dom.js";
import { Gamepads } from "../gamepad.js";
import { holdable } from "../hold.js";

const MM = 0.5; // mm of the tool for a px of the finger

export function followPart(app) {
  const { texts, follower } = app;
  const pad = el("button.touch", { type: "button", "aria-label": texts.follow.pad }, el("span", { "aria-hidden": "true" }, texts.follow.padLabel));
  const strip = el("button.touch.strip", { type: "button", "aria-label": texts.follow.height }, el("span", { "aria-hidden": "true" }, texts.follow.heightLabel));
  const picture = el("input", { type: "checkbox", id: "follow-picture", on: { change: () => { follower.inPicture = picture.checked; } } });
  const speed = el("input", { type: "range", id: "follow-speed", min: 10, max: 300, step: 10, value: follower.maxSpeed, on: { input: () => speedChanged() } });
  const figure = el("output", { for: "follow-speed" });
  const state = el("span.follow-state", { role: "status" });
  const gamepad = el("p.hint");
  const gate = el("fieldset.gate", {},
    el("div.touches", {}, pad, strip),
    el("p.hint", {}, texts.follow.hint),
    el("div.field.check", {}, picture, el("label", { for: "follow-picture" }, texts.follow.drag)),
    el("div.field.slider", {}, el("label", { for: "follow-speed" }, texts.follow.speed), speed, figure),
    gamepad);
  const element = el("section.card.follow", { "aria-labelledby": "follow-title" }, el("h2", { id: "follow-title" }, texts.follow.title, state), gate);

  const speedChanged = () => {
    follower.maxSpeed = Number(speed.value);
    say(figure, `${speed.value} ${texts.follow.unit}`);
  };
  speedChanged();

  // Up on the pad is away from the foot (x), left is left (y).
  lead(pad, (right, down) => [-down * MM, -right * MM, 0], { ArrowUp: [1, 0, 0], ArrowDown: [-1, 0, 0], ArrowLeft: [0, 1, 0], ArrowRight: [0, -1, 0] });
  lead(strip, (_, down) => [0, 0, -down * MM], { ArrowUp: [0, 0, 1], ArrowDown: [0, 0, -1] });

  function lead(element, mm, keys) {
    let at = [0, 0];
    holdable(element, {
      ready: () => follower.able(),
      start: event => { at = [event.clientX, event.clientY]; follower.start(); },
      move: event => {
        follower.by(mm(event.clientX - at[0], event.clientY - at[1]));
        at = [event.clientX, event.clientY];
      },
      beat: () => follower.beat(),
      stop: reason => follower.stop(reason),
    });
    // While Space is held on it, the arrow keys lead.
    element.addEventListener("keydown", event => {
      if (!keys[event.key] || follower.state === "idle") return;
      event.preventDefault();
      follower.by(keys[event.key]);
    });
  }

  follower.changed = now => {
    say(state, now === "idle" ? "" : texts.follow[now]);
    mark(element, "data-active", now === "idle" ? false : "yes");
    app.update("target");
  };

  new Gamepads(app, follower, name => say(gamepad, name ? `${name}: ${texts.follow.gamepadHint}` : texts.follow.noGamepad));

  return {
    element,
    update(topic) {
      if (topic === "follow" && app.arm.follow.state === "ended") follower.ended(app.arm.follow.why);
      if (topic === "select") element.hidden = !app.arm?.can("follow");
      if (["select", "lease", "connection"].includes(topic)) gate.disabled = !app.mine;
    },
  };
}
