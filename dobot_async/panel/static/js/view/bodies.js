// What a cell looks like in 3-D: one small maker for each kind of thing. All in mm, in the coordinates of the cell, z up.

import * as THREE from "../../vendor/three.js";
import { toCell } from "../model.js";
import { pieceColor } from "./colors.js";

const AROUND = 28; // sides of a cylinder
const ENDLESS = 600; // mm; how far an endless zone is shown
const UP = 400;

export const dispose = object => object.traverse(each => {
  each.geometry?.dispose();
  each.material?.map?.dispose();
  each.material?.dispose();
});

const solid = color => new THREE.MeshStandardMaterial({ color, roughness: 0.55, metalness: 0.1 });
const clear = (color, opacity) =>
  new THREE.MeshBasicMaterial({ color, transparent: true, opacity, depthWrite: false, side: THREE.DoubleSide });

/** A line through points; dashed ones are pieces of two points. */
export function lineOf(points, color, { pieces = false, opacity = 1 } = {}) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points.flat()), 3));
  const material = new THREE.LineBasicMaterial({ color, transparent: opacity < 1, opacity });
  return pieces ? new THREE.LineSegments(geometry, material) : new THREE.Line(geometry, material);
}

/** Strokes as one object. */
export function strokesOf(strokes, color) {
  const pieces = strokes.flatMap(stroke => stroke.slice(1).flatMap((point, n) => [stroke[n], point]));
  return lineOf(pieces, color, { pieces: true });
}

/** A line of text that always faces the reader. */
export function label(text, color, height = 26) {
  const canvas = document.createElement("canvas");
  const pen = canvas.getContext("2d");
  const font = "600 44px system-ui, sans-serif";
  pen.font = font;
  canvas.width = Math.ceil(pen.measureText(text).width) + 12;
  canvas.height = 60;
  pen.font = font;
  pen.fillStyle = color;
  pen.textBaseline = "middle";
  pen.fillText(text, 6, 32);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas), depthTest: false, transparent: true }));
  sprite.scale.set((height * canvas.width) / canvas.height, height, 1);
  return sprite;
}

function box(size, material, edges) {
  const geometry = new THREE.BoxGeometry(...size);
  const mesh = new THREE.Mesh(geometry, material);
  if (edges) mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry), new THREE.LineBasicMaterial({ color: edges, transparent: true, opacity: 0.5 })));
  return mesh;
}

/** A thing of the scene. `at` is the middle of its lower face. */
export function thingOf(thing, colors) {
  if (thing.kind === "sensor") {
    const group = new THREE.Group();
    const color = thing.on ? colors["view-target"] : colors["view-sensor"];
    const eye = new THREE.Mesh(new THREE.SphereGeometry(5, 12, 8), solid(color));
    eye.position.set(...thing.at);
    group.add(lineOf([thing.at, thing.to], color), eye);
    return group;
  }
  const color = thing.kind === "piece" ? pieceColor(thing.color) : colors[`view-${thing.kind}`] ?? colors["view-block"];
  const mesh = box(thing.size, solid(color), colors["view-ink"]);
  mesh.position.set(thing.at[0], thing.at[1], thing.at[2] + thing.size[2] / 2);
  mesh.rotation.z = ((thing.yaw ?? 0) * Math.PI) / 180;
  return mesh;
}

const shown = (range, low, high) => [range?.[0] ?? low, range?.[1] ?? high];

/** A zone: see-through, with its name above it. */
export function zoneOf(zone, colors, floor) {
  const [z0, z1] = shown(zone.z, floor, floor + UP);
  const color = colors["view-zone"];
  let mesh;
  if (zone.kind === "cylinder") {
    mesh = new THREE.Mesh(new THREE.CylinderGeometry(zone.radius, zone.radius, z1 - z0, AROUND), clear(color, 0.14));
    mesh.geometry.rotateX(Math.PI / 2);
    mesh.position.set(zone.x0 ?? zone.x, zone.y0 ?? zone.y, (z0 + z1) / 2);
  } else {
    const [[x0, x1], [y0, y1]] = [shown(zone.x, -ENDLESS, ENDLESS), shown(zone.y, -ENDLESS, ENDLESS)];
    mesh = box([x1 - x0, y1 - y0, z1 - z0], clear(color, 0.14), color);
    mesh.position.set((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2);
  }
  const name = label(zone.name, colors["view-ink"]);
  name.position.z = (z1 - z0) / 2 + 16;
  mesh.add(name);
  return mesh;
}

/** What an arm can reach, flat on the floor, and the box that it is kept in. */
export function reachOf(info, colors, floor) {
  const group = new THREE.Group();
  const { base, reach, limits } = info;
  if (reach) {
    const [from, to] = (reach.sector ?? [-180, 180]).map(angle => (angle * Math.PI) / 180);
    const ring = new THREE.Mesh(new THREE.RingGeometry(Math.max(reach.inner, 1), reach.outer, 64, 1, from, to - from), clear(colors["view-reach"], 0.16));
    ring.position.set(base?.x ?? 0, base?.y ?? 0, floor + 0.5);
    ring.rotation.z = ((base?.yaw ?? 0) * Math.PI) / 180;
    group.add(ring);
  }
  if (limits) {
    const size = limits.map(([low, high]) => high - low);
    const edges = new THREE.LineSegments(new THREE.EdgesGeometry(new THREE.BoxGeometry(...size)), new THREE.LineBasicMaterial({ color: colors["view-reach"] }));
    edges.position.set(...toCell(base, limits.map(([low, high]) => (low + high) / 2)));
    edges.rotation.z = ((base?.yaw ?? 0) * Math.PI) / 180;
    group.add(edges);
  }
  return group;
}

/** A mark at a place that an arm is going to. */
export function targetOf(colors) {
  const group = new THREE.Group();
  const color = colors["view-target"];
  const ring = new THREE.Mesh(new THREE.RingGeometry(11, 14, 32), new THREE.MeshBasicMaterial({ color, side: THREE.DoubleSide }));
  group.add(ring, lineOf([[-20, 0, 0], [20, 0, 0], [0, -20, 0], [0, 20, 0], [0, 0, -20], [0, 0, 20]], color, { pieces: true }));
  return group;
}

/** An arm: a cylinder or a box for each part between two neighbouring points, and a ball for each joint. */
export class ArmBody extends THREE.Group {
  constructor(info, color, colors) {
    super();
    const [paint, joint] = [solid(color), solid(colors["view-joint"])];
    this.parts = info.shape.map(part => {
      const r = part.radius;
      const geometry = part.kind === "box" ? new THREE.BoxGeometry(2 * r, 2 * r, 1) : new THREE.CylinderGeometry(r, r, 1, AROUND).rotateX(Math.PI / 2);
      const mesh = new THREE.Mesh(geometry, part.name === "tool" ? joint : paint);
      this.add(mesh);
      return mesh;
    });
    this.joints = info.shape.slice(0, -1).map((part, n) => {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(1.3 * Math.min(part.radius, info.shape[n + 1].radius), 24, 16), joint);
      this.add(ball);
      return ball;
    });
    const foot = info.shape[0]?.radius ?? 40;
    this.foot = new THREE.Mesh(new THREE.CylinderGeometry(foot * 1.5, foot * 1.6, 10, 40).rotateX(Math.PI / 2), joint);
    this.tip = new THREE.Mesh(new THREE.SphereGeometry(7, 16, 12), new THREE.MeshBasicMaterial({ color: colors["view-target"] }));
    this.add(this.foot, this.tip);
  }

  /** Put the parts where points of the cell are. */
  place(points) {
    this.parts.forEach((mesh, n) => {
      const [a, b] = [points[n], points[n + 1]];
      if (!a || !b) return;
      const length = Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
      mesh.visible = length > 0.5;
      mesh.position.set((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2);
      mesh.scale.z = Math.max(length, 0.5);
      mesh.lookAt(...b);
    });
    this.joints.forEach((ball, n) => points[n + 1] && ball.position.set(...points[n + 1]));
    this.foot.position.set(points[0][0], points[0][1], points[0][2] + 5);
    this.tip.position.set(...points.at(-1));
  }
}
