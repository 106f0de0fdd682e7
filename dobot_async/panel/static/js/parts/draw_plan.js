// A drawing as it lies before an arm, seen from above: dragged to place it, dragged at its corner for its size.

import { el } from "../dom.js";
import { viewColors } from "../view/colors.js";
import { Plan, sector } from "../view/plan.js";

const GRIP = 22; // px
const MARGIN = 30; // mm
const MOVES = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };
const LARGER = { "+": 1.05, "=": 1.05, "-": 1 / 1.05 };

/** In the plan x points up and y to the left, as it looks from behind the arm. */
const flat = ([x, y]) => [-y, x];

export class DrawPlan {
  /**
   * @param {object} words
   * @param {(place: {x: number, y: number, width: number}) => void} placed called when it was moved by hand
   */
  constructor(words, placed) {
    this.placed = placed;
    this.rings = [];
    this.element = el("canvas.plan", { tabindex: 0, role: "application", "aria-label": words.plan });
    this.plan = new Plan(this.element);
    this.element.addEventListener("pointerdown", event => this.press(event));
    this.element.addEventListener("pointermove", event => this.drag(event));
    for (const type of ["pointerup", "pointercancel"]) this.element.addEventListener(type, () => { this.grip = null; });
    this.element.addEventListener("keydown", event => this.key(event));
  }

  show(arm, file, placed) {
    Object.assign(this, { arm, file, at: placed });
    this.draw();
  }

  reach(rings) {
    this.rings = rings;
    this.draw();
  }

  /** A point of the file where it lies, mm in the arm's coordinates. */
  lay([x, y]) {
    const { plane, size } = this.at;
    const [x0, y0, x1] = this.file.bounds;
    const scale = x1 > x0 ? size[0] / (x1 - x0) : 1;
    const [dx, dy] = [(x - x0) * scale, (y - y0) * scale];
    const [c, s] = [Math.cos((plane.rotation * Math.PI) / 180), Math.sin((plane.rotation * Math.PI) / 180)];
    return [plane.x + c * dx - s * dy, plane.y + s * dx + c * dy];
  }

  frame() {
    const [x0, y0, x1, y1] = this.file.bounds;
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(point => this.lay(point));
  }

  draw() {
    if (!this.at || !this.element.clientWidth) return;
    const colors = viewColors();
    const { plan, arm } = this;
    const [width, height] = plan.begin(colors["view-sky"]);
    const outer = (arm.info.reach?.outer ?? 300) + MARGIN;
    const frame = this.frame();
    const [xs, ys] = [0, 1].map(axis => frame.map(point => point[axis]));
    plan.fit([Math.min(-outer, -Math.max(...ys) - MARGIN), Math.max(outer, -Math.min(...ys) + MARGIN)],
      [Math.min(-MARGIN, Math.min(...xs) - MARGIN), Math.max(outer, Math.max(...xs) + MARGIN)], [0, 0, width, height]);
    plan.grid([-2 * outer, 2 * outer], [-outer, 2 * outer], 50, colors["view-grid"]);
    const rings = this.rings.length ? this.rings : arm.info.reach ? [sector(arm.info.reach)] : [];
    for (const ring of rings) plan.area(ring.map(flat), colors["view-reach"], 0.22);
    plan.dot([0, 0], colors["view-joint"], 8);
    for (const line of this.file.lines) plan.line(line.map(point => flat(this.lay(point))), colors["view-draw"], 1.3);
    plan.line([...frame, frame[0]].map(flat), colors["view-target"], 1.2, [5, 4]);
    plan.dot(flat(frame[2]), colors["view-target"], 9);
    const tool = arm.state?.points?.at(-1);
    if (tool) plan.dot(flat(tool), colors["arm-1"], 5);
  }

  pointer(event) {
    const { left, top } = this.element.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  mm(event) {
    const [across, up] = this.plan.mm(this.pointer(event));
    return [up, -across];
  }

  press(event) {
    if (!this.at || event.button !== 0) return;
    const [x, y] = this.pointer(event);
    const [left, top] = this.plan.px(flat(this.frame()[2]));
    this.element.setPointerCapture(event.pointerId);
    this.grip = { size: Math.hypot(x - left, y - top) < GRIP, from: this.mm(event), x: this.at.plane.x, y: this.at.plane.y, width: this.at.size[0] };
  }

  drag(event) {
    if (!this.grip) return;
    const { size, from, x, y, width } = this.grip;
    const to = this.mm(event);
    if (!size) return this.placed({ x: x + to[0] - from[0], y: y + to[1] - from[1], width });
    const far = point => Math.hypot(point[0] - x, point[1] - y);
    return this.placed({ x, y, width: Math.max(2, (width * far(to)) / Math.max(far(from), 1)) });
  }

  key(event) {
    const [move, larger] = [MOVES[event.key], LARGER[event.key]];
    if (!this.at || (!move && !larger)) return;
    event.preventDefault();
    const far = event.shiftKey ? 10 : 1;
    const { plane, size } = this.at;
    this.placed({ x: plane.x + far * (move?.[0] ?? 0), y: plane.y + far * (move?.[1] ?? 0), width: size[0] * (larger ?? 1) });
  }
}
