// The cell in 3-D. Drawn only when something has changed.

import * as THREE from "../../vendor/three.js";
import { holdable } from "../hold.js";
import { toArm, toCell } from "../model.js";
import { ArmBody, dispose, label, lineOf, reachOf, strokesOf, targetOf, thingOf, zoneOf } from "./bodies.js";
import { armColor, viewColors } from "./colors.js";

const GRAB = 30; // px around the tool where a press takes hold of it
const TRACE = 1500;
const GRID = 1200;

/** Whether this browser can draw it. */
export function hasWebGL() {
  try {
    return Boolean(document.createElement("canvas").getContext("webgl2"));
  } catch {
    return false;
  }
}

export class View3D {
  /**
   * @param {import("../model.js").Model} model
   * @param {{label: string, selected: () => object, lead: object}} hooks lead: what a drag of the tool does, see follower.js
   */
  constructor(model, hooks) {
    this.model = model;
    this.hooks = hooks;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, powerPreference: "low-power" });
    this.element = this.renderer.domElement;
    this.element.className = "picture";
    this.element.tabIndex = 0;
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", hooks.label);
    this.camera = new THREE.PerspectiveCamera(38, 1, 5, 6000);
    this.camera.up.set(0, 0, 1);
    this.scene = new THREE.Scene();
    this.layers = new Map();
    this.bodies = new Map();
    this.things = new Map();
    this.watchDrag();
    this.controls = new OrbitControls3(this.camera, this.element);
    this.controls.addEventListener("change", () => this.request());
    this.controls.addEventListener("start", () => { this.turned = true; });
    this.element.addEventListener("webglcontextlost", event => { event.preventDefault(); hooks.lost?.(); });
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(this.element);
    this.rebuild();
    this.home();
  }

  /** All that does not move, once more: another theme, other arms, another table. */
  rebuild() {
    const colors = (this.colors = viewColors());
    for (const object of [...this.scene.children]) this.drop(object);
    this.layers.clear();
    this.bodies.clear();
    this.things.clear();
    this.scene.background = new THREE.Color(colors["view-sky"]);
    const sun = new THREE.DirectionalLight(0xffffff, 1.7);
    sun.position.set(300, -500, 900);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8894a5, 1.9), sun);
    const floor = (this.floor = this.level());
    const grid = new THREE.GridHelper(GRID, 24, colors["view-grid"], colors["view-grid"]);
    grid.rotation.x = Math.PI / 2;
    grid.position.z = floor;
    this.scene.add(grid, lineOf([[0, 0, floor + 1], [120, 0, floor + 1]], colors["view-x"]), lineOf([[0, 0, floor + 1], [0, 120, floor + 1]], colors["view-y"]));
    for (const [text, at, color] of [["x", [150, 0], "view-x"], ["y", [0, 150], "view-y"]]) {
      const sprite = label(text, colors[color], 26);
      sprite.position.set(...at, floor + 8);
      this.scene.add(sprite);
    }
    for (const zone of this.model.zones) this.scene.add(zoneOf(zone, colors, floor));
    [...this.model.arms.values()].forEach((arm, n) => this.addArm(arm, n));
    this.update();
    this.framed = "";
  }

  addArm(arm, number) {
    const color = armColor(this.colors, number);
    const body = new ArmBody(arm.info, color, this.colors);
    const trace = lineOf([], color, { opacity: 0.75 });
    trace.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(TRACE * 3), 3));
    trace.frustumCulled = false;
    const target = targetOf(this.colors);
    const name = this.model.arms.size > 1 ? label(arm.name, color, 34) : null;
    body.visible = target.visible = false;
    this.scene.add(reachOf(arm.info, this.colors, this.floor), body, trace, target);
    if (name) body.add(name);
    this.bodies.set(arm.name, { body, trace, target, name });
  }

  /** The table, or the lowest foot. */
  level() {
    const feet = [...this.model.arms.values()].map(arm => (arm.state?.points ? toCell(arm.info.base, arm.state.points[0])[2] : 0));
    return this.model.table ?? Math.min(0, ...feet);
  }

  /** What has moved. */
  update() {
    if (this.level() !== this.floor) return this.rebuild();
    for (const arm of this.model.arms.values()) this.updateArm(arm, this.bodies.get(arm.name));
    this.updateThings();
    this.frameOnce();
    this.layer("strokes", this.model.strokes, strokes => strokesOf(strokes, this.colors["view-ink"]), strokes => strokes.length);
    return this.request();
  }

  /** Look at all arms when it is first known where they are. */
  frameOnce() {
    const known = [...this.model.arms.values()].filter(arm => arm.state?.points).map(arm => arm.name).join();
    if (this.controls && this.sized && known !== this.framed && !this.turned) this.home();
    this.framed = known;
  }

  updateArm(arm, { body, trace, target, name }) {
    const { base } = arm.info;
    const points = arm.state?.points?.map(point => toCell(base, point));
    body.visible = Boolean(points);
    if (points) body.place(points);
    if (points && name) name.position.set(points[0][0], points[0][1], Math.max(...points.map(point => point[2])) + 50);
    const places = trace.geometry.attributes.position;
    arm.trace.slice(-TRACE).forEach((place, n) => places.setXYZ(n, ...toCell(base, place)));
    places.needsUpdate = true;
    trace.geometry.setDrawRange(0, Math.min(arm.trace.length, TRACE));
    target.visible = Boolean(arm.target);
    if (arm.target) target.position.set(...toCell(base, arm.target));
    this.layer(`drawing ${arm.name}`, arm.drawing, lines => strokesOf(lines.map(line => line.map(point => toCell(base, point))), this.colors["view-draw"]));
  }

  updateThings() {
    const gone = new Set(this.things.keys());
    for (const thing of this.model.things) {
      gone.delete(thing.name);
      const text = JSON.stringify(thing);
      const there = this.things.get(thing.name);
      if (there?.text === text) continue;
      if (there) this.drop(there.object);
      const object = thingOf(thing, this.colors);
      this.scene.add(object);
      this.things.set(thing.name, { text, object });
    }
    for (const name of gone) {
      this.drop(this.things.get(name).object);
      this.things.delete(name);
    }
  }

  /** An object that is made again when what it is made of is another one. */
  layer(name, of, make, version = () => 0) {
    const there = this.layers.get(name);
    if (there?.of === of && there.version === version(of)) return;
    if (there?.object) this.drop(there.object);
    const object = of.length ? make(of) : null;
    if (object) this.scene.add(object);
    this.layers.set(name, { of, version: version(of), object });
  }

  drop(object) {
    this.scene.remove(object);
    dispose(object);
  }

  /** Look at all arms from the front, a little from the side, from as far as they need. */
  home() {
    const { low, high } = this.extent();
    const middle = low.map((value, axis) => (value + high[axis]) / 2);
    const radius = Math.hypot(...low.map((value, axis) => (high[axis] - value) / 2));
    const narrow = Math.min(1, this.camera.aspect);
    const far = (0.94 * radius) / Math.sin((this.camera.fov * Math.PI) / 360) / narrow;
    this.controls.target.set(...middle);
    this.camera.position.set(middle[0] + 0.62 * far, middle[1] - 0.64 * far, middle[2] + 0.45 * far);
    this.controls.update();
    this.request();
  }

  /** The box around all arms, and some of the table before each. */
  extent() {
    const points = [...this.model.arms.values()].flatMap(({ info, state }) =>
      [[-60, -120, 0], [(info.reach?.outer ?? 250) * 0.8, 120, 0], ...(state?.points ?? [[0, 0, 200]])].map((point, n) => {
        const [x, y, z] = toCell(info.base, point);
        return n < 2 ? [x, y, this.floor] : [x, y, z];
      }));
    const along = axis => points.map(point => point[axis]);
    if (!points.length) return { low: [-100, -100, 0], high: [300, 100, 200] };
    return { low: [0, 1, 2].map(axis => Math.min(...along(axis))), high: [0, 1, 2].map(axis => Math.max(...along(axis))) };
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.sized) this.home();
    this.sized = true;
    this.request();
  }

  request() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      if (this.element.clientWidth) this.renderer.render(this.scene, this.camera);
    });
  }

  /** A press near the tool of the selected arm takes hold of it; the picture does not turn then. */
  watchDrag() {
    const { lead } = this.hooks;
    holdable(this.element, {
      keys: false,
      ready: event => lead.ready() && this.grabs(event),
      start: event => { this.grip = this.plane(); lead.start(); this.drag(event); },
      move: event => this.drag(event),
      beat: () => lead.beat(),
      stop: reason => lead.stop(reason),
    });
  }

  tool() {
    const arm = this.hooks.selected();
    const point = arm?.state?.points?.at(-1);
    return point ? new THREE.Vector3(...toCell(arm.info.base, point)) : null;
  }

  grabs(event) {
    const tool = this.tool();
    if (!tool) return false;
    tool.project(this.camera);
    const { left, top, width, height } = this.element.getBoundingClientRect();
    return Math.hypot(event.clientX - left - ((tool.x + 1) / 2) * width, event.clientY - top - ((1 - tool.y) / 2) * height) < GRAB;
  }

  /** The level of the tool. */
  plane() {
    return new THREE.Plane(new THREE.Vector3(0, 0, 1), -this.tool().z);
  }

  drag(event) {
    const { left, top, width, height } = this.element.getBoundingClientRect();
    const pointer = new THREE.Vector2(((event.clientX - left) / width) * 2 - 1, 1 - ((event.clientY - top) / height) * 2);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(pointer, this.camera);
    const place = ray.ray.intersectPlane(this.grip, new THREE.Vector3());
    if (place) this.hooks.lead.to(toArm(this.hooks.selected().info.base, place.toArray()));
  }

  close() {
    this.sizes.disconnect();
    this.controls.dispose();
    cancelAnimationFrame(this.frame);
    for (const object of [...this.scene.children]) this.drop(object);
    this.renderer.dispose();
  }
}

/** Orbit by mouse, touch and, while the picture has the focus, by the arrow keys. */
class OrbitControls3 extends THREE.OrbitControls {
  constructor(camera, element) {
    super(camera, element);
    this.minDistance = 150;
    this.maxDistance = 3500;
    this.maxPolarAngle = Math.PI / 2 + 0.1;
    const turns = { ArrowLeft: [0.12, 0], ArrowRight: [-0.12, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    element.addEventListener("keydown", event => {
      const turn = turns[event.key];
      if (!turn) return;
      event.preventDefault();
      this.turn(...turn);
    });
  }

  /** Turn about the vertical, and up or down. */
  turn(about, up) {
    const from = this.object.position.clone().sub(this.target);
    const [radius, flat] = [from.length(), Math.atan2(from.y, from.x) + about];
    const height = Math.min(Math.max(Math.acos(from.z / radius) + up, 0.05), this.maxPolarAngle);
    const out = radius * Math.sin(height);
    this.object.position.set(this.target.x + out * Math.cos(flat), this.target.y + out * Math.sin(flat), this.target.z + radius * Math.cos(height));
    this.update();
  }
}
