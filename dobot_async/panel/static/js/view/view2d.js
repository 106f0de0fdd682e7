// The cell in 2-D, from above and from the side, for browsers without WebGL and for who prefers it.

import { holdable } from "../hold.js";
import { toArm, toCell } from "../model.js";
import { armColor, pieceColor, viewColors } from "./colors.js";
import { Plan, corners, sector } from "./plan.js";

const GRAB = 28; // px
const MARGIN = 40; // mm
const LEAST = 320; // mm around an arm whose reach is not known

export class View2D {
  constructor(model, hooks) {
    this.model = model;
    this.hooks = hooks;
    this.element = document.createElement("canvas");
    this.element.className = "picture";
    this.element.tabIndex = 0;
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", hooks.label);
    this.above = new Plan(this.element);
    this.side = new Plan(this.element);
    this.sizes = new ResizeObserver(() => this.request());
    this.sizes.observe(this.element);
    const { lead } = hooks;
    holdable(this.element, {
      keys: false,
      ready: event => lead.ready() && this.grabs(event),
      start: event => { this.height = hooks.selected().state.points.at(-1)[2]; lead.start(); this.drag(event); },
      move: event => this.drag(event),
      beat: () => lead.beat(),
      stop: reason => lead.stop(reason),
    });
    this.rebuild();
  }

  rebuild() {
    this.colors = viewColors();
    this.request();
  }

  update() {
    this.request();
  }

  home() {
    this.request();
  }

  request() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      if (this.element.clientWidth) this.draw();
    });
  }

  /** What has to be seen, mm of the cell. */
  area() {
    const [xs, ys] = [[], []];
    for (const { info } of this.model.arms.values()) {
      const radius = (info.reach?.outer ?? LEAST) + MARGIN;
      const [x, y] = toCell(info.base, [0, 0, 0]);
      const around = info.reach ? sector(info.reach, [x, y], info.base?.yaw ?? 0) : [[x - radius, y - radius], [x + radius, y + radius]];
      xs.push(x - MARGIN, x + MARGIN, ...around.map(point => point[0]));
      ys.push(y - MARGIN, y + MARGIN, ...around.map(point => point[1]));
    }
    return [[Math.min(...xs) - MARGIN, Math.max(...xs) + MARGIN], [Math.min(...ys) - MARGIN, Math.max(...ys) + MARGIN]];
  }

  draw() {
    const [width, height] = this.above.begin(this.colors["view-sky"]);
    if (!this.model.arms.size) return;
    const wide = width > 1.2 * height;
    const split = (wide ? width : height) * 0.58;
    const [xs, ys] = this.area();
    this.above.fit(xs, ys, wide ? [0, 0, split, height] : [0, 0, width, split]);
    this.drawAbove(xs, ys);
    this.above.pen.fillStyle = this.colors["view-sky"];
    const rest = wide ? [split, 0, width - split, height] : [0, split, width, height - split];
    this.above.pen.fillRect(...rest);
    const zs = this.heights();
    this.side.fit(xs, zs, rest);
    this.drawSide(xs, zs);
    this.above.text(this.hooks.words.top, [8, 18], this.colors["view-ink"]);
    this.above.text(this.hooks.words.side, [rest[0] + 8, rest[1] + rest[3] - 8], this.colors["view-ink"]);
  }

  drawAbove(xs, ys) {
    const { above, colors } = this;
    above.grid(xs, ys, 100, colors["view-grid"]);
    for (const zone of this.model.zones) this.drawZone(zone, xs, ys);
    for (const thing of this.model.things) {
      if (thing.kind === "sensor") above.line([thing.at, thing.to], thing.on ? colors["view-target"] : colors["view-sensor"], 2);
      else above.area(corners(thing.at, thing.size, thing.yaw), thing.kind === "piece" ? pieceColor(thing.color) : colors[`view-${thing.kind}`], 0.85);
    }
    for (const stroke of this.model.strokes) above.line(stroke, colors["view-ink"], 1);
    [...this.model.arms.values()].forEach((arm, n) => this.drawArm(arm, n));
  }

  drawZone(zone, xs, ys) {
    const color = this.colors["view-zone"];
    const ring = zone.kind === "cylinder"
      ? sector({ inner: 0, outer: zone.radius }, [zone.x0 ?? zone.x, zone.y0 ?? zone.y])
      : corners([0, 1].map(axis => middle(zone["xy"[axis]], [xs, ys][axis])), [0, 1].map(axis => extent(zone["xy"[axis]], [xs, ys][axis])));
    this.above.area(ring, color, 0.14);
    this.above.text(zone.name, this.above.px(ring[0]), color);
  }

  drawArm(arm, number) {
    const { above, colors } = this;
    const { base, reach } = arm.info;
    const color = armColor(colors, number);
    const [x, y] = toCell(base, [0, 0, 0]);
    if (reach) above.area(sector(reach, [x, y], base?.yaw ?? 0), colors["view-reach"], 0.14);
    above.line(arm.trace.map(place => toCell(base, place)), color, 1);
    for (const line of arm.drawing) above.line(line.map(place => toCell(base, place)), colors["view-draw"], 1.2);
    above.dot([x, y], colors["view-joint"], 10);
    const points = arm.state?.points?.map(point => toCell(base, point));
    if (points) {
      above.line(points, color, 7);
      for (const point of points) above.dot(point, colors["view-joint"], 4);
      above.dot(points.at(-1), colors["view-target"], 6);
    }
    if (arm.target) {
      const at = toCell(base, arm.target);
      above.line([[at[0] - 15, at[1]], [at[0] + 15, at[1]]], colors["view-target"], 2);
      above.line([[at[0], at[1] - 15], [at[0], at[1] + 15]], colors["view-target"], 2);
    }
    if (this.model.arms.size > 1) above.text(arm.name, [above.px([x, y])[0] + 12, above.px([x, y])[1] - 12], color);
  }

  heights() {
    const points = [...this.model.arms.values()].flatMap(arm => (arm.state?.points ?? []).map(point => toCell(arm.info.base, point)[2]));
    return [Math.min(this.model.table ?? 0, 0, ...points) - MARGIN, Math.max(250, ...points) + MARGIN];
  }

  drawSide(xs, zs) {
    const { side, colors } = this;
    const tables = this.model.table ?? Math.min(0, ...[...this.model.arms.values()].map(arm => arm.state?.points?.[0][2] ?? 0));
    side.grid(xs, zs, 100, colors["view-grid"]);
    side.line([[xs[0], tables], [xs[1], tables]], colors["view-ink"], 1.5);
    for (const thing of this.model.things) {
      if (thing.kind === "sensor") continue;
      const [x, , z] = thing.at;
      side.area(corners([x, z + thing.size[2] / 2], [thing.size[0], thing.size[2]]), thing.kind === "piece" ? pieceColor(thing.color) : colors[`view-${thing.kind}`], 0.8);
    }
    [...this.model.arms.values()].forEach((arm, n) => {
      const points = arm.state?.points?.map(point => toCell(arm.info.base, point)).map(([x, , z]) => [x, z]);
      if (!points) return;
      side.line(points, armColor(colors, n), 7);
      for (const point of points) side.dot(point, colors["view-joint"], 4);
      side.dot(points.at(-1), colors["view-target"], 6);
    });
  }

  at(event) {
    const { left, top } = this.element.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  grabs(event) {
    const arm = this.hooks.selected();
    const tool = arm?.state?.points?.at(-1);
    if (!tool) return false;
    const [left, top] = this.above.px(toCell(arm.info.base, tool));
    const [x, y] = this.at(event);
    return Math.hypot(x - left, y - top) < GRAB;
  }

  drag(event) {
    const { base } = this.hooks.selected().info;
    const place = toArm(base, [...this.above.mm(this.at(event)), 0]);
    this.hooks.lead.to([place[0], place[1], this.height]);
  }

  close() {
    this.sizes.disconnect();
    cancelAnimationFrame(this.frame);
  }
}

const middle = (range, whole) => ((range?.[0] ?? whole[0]) + (range?.[1] ?? whole[1])) / 2;
const extent = (range, whole) => (range?.[1] ?? whole[1]) - (range?.[0] ?? whole[0]);
