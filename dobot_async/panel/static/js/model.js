// What the server has said so far: one Arm for each arm, the zones and the scene of the cell, the log, and who we are.

const TRACE = 1500; // places of the tool that are kept: 75 s at 20 a second
const NEAR = 0.3; // mm; a tool that moved less has not moved
const LOG = 300;
const STROKES = 4000;

class Arm {
  constructor(info) {
    this.info = info;
    this.name = info.name;
    this.state = null;
    this.link = { state: "connecting", why: "" };
    this.alarms = [];
    this.queue = { items: [], pending: 0 };
    this.io = {};
    this.lease = { holder: null, mine: false };
    this.recording = { steps: [], problems: [], modes: [] };
    this.jog = null;
    this.follow = null;
    this.trace = [];
    this.target = null; // [x, y, z] that is shown, in the arm's coordinates
    this.drawing = []; // lines of a drawing that is being placed, in the arm's coordinates
    this.outline = null; // rings of what can be reached, and at which height
  }

  can(feature) {
    return this.info.features.includes(feature);
  }

  moved(state) {
    this.state = state;
    const tool = state.points?.at(-1);
    const last = this.trace.at(-1);
    if (tool && (!last || Math.hypot(tool[0] - last[0], tool[1] - last[1], tool[2] - last[2]) > NEAR)) {
      this.trace.push(tool);
      if (this.trace.length > TRACE) this.trace.splice(0, this.trace.length - TRACE);
    }
  }
}

export class Model {
  constructor() {
    this.arms = new Map();
    this.zones = [];
    this.things = [];
    this.table = null;
    this.strokes = [];
    this.log = [];
    this.role = "viewer";
    this.you = "";
    this.version = "";
  }

  /** Take a message in; returns the name of the arm it is about, "" for the cell, null for a message that is not known. */
  take(message) {
    const arm = this.arms.get(message.arm);
    switch (message.type) {
      case "hello": this.greet(message); return "";
      case "arm": this.arms.get(message.arm.name).info = message.arm; return message.arm.name;
      case "scene": this.see(message); return "";
      case "log":
        this.log.push(message);
        if (this.log.length > LOG) this.log.shift();
        return "";
      case "state": arm?.moved(message); break;
      case "alarms": if (arm) arm.alarms = message.alarms; break;
      case "link": case "queue": case "io": case "lease": case "recording": case "jog": case "follow":
        if (arm) arm[message.type] = message;
        break;
      default: return null;
    }
    return arm ? arm.name : null;
  }

  greet(hello) {
    this.role = hello.role;
    this.you = hello.you;
    this.version = hello.version;
    this.zones = hello.zones;
    this.log = [];
    this.strokes = [];
    this.things = [];
    const before = this.arms;
    this.arms = new Map(hello.arms.map(info => [info.name, new Arm(info)]));
    for (const arm of this.arms.values()) arm.trace = before.get(arm.name)?.trace ?? [];
  }

  see(scene) {
    this.table = scene.table;
    this.things = scene.things;
    this.strokes.push(...(scene.drawing ?? []));
    if (this.strokes.length > STROKES) this.strokes.splice(0, this.strokes.length - STROKES);
  }
}

/** A place of an arm, in the coordinates of its cell. */
export function toCell(base, [x, y, z]) {
  const yaw = ((base?.yaw ?? 0) * Math.PI) / 180;
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return [(base?.x ?? 0) + c * x - s * y, (base?.y ?? 0) + s * x + c * y, (base?.z ?? 0) + z];
}

/** A place of the cell, in the coordinates of an arm. */
export function toArm(base, [x, y, z]) {
  const yaw = ((base?.yaw ?? 0) * Math.PI) / 180;
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const [dx, dy] = [x - (base?.x ?? 0), y - (base?.y ?? 0)];
  return [c * dx + s * dy, -s * dx + c * dy, z - (base?.z ?? 0)];
}
