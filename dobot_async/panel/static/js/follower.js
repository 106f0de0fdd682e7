// The arm follows a place that is led by a finger, a mouse or a gamepad. Beats are the targets themselves: none without a hold.

import { texts } from "./texts.js";
import { toast } from "./dialogs.js";
import { releaseAll } from "./hold.js";

const FASTEST = 1000 / 30; // ms between two targets

export class Follower {
  constructor(app) {
    this.app = app;
    this.maxSpeed = 100; // mm/s
    this.inPicture = false; // whether the tool may be dragged in the picture
    this.state = "idle";
    this.arm = null;
    this.sent = 0;
    this.changed = () => {};
  }

  ready() {
    return this.inPicture && this.able();
  }

  /** Whether following can begin. */
  able() {
    const { app } = this;
    return app.mine && app.arm.can("follow") && Boolean(app.arm.state?.points);
  }

  async start() {
    const arm = (this.arm = this.app.arm);
    const turn = (this.turn = Symbol("turn"));
    this.place = arm.info.axes.map(axis => arm.state.pose[axis.name]);
    this.become("starting");
    const { connection } = this.app;
    try {
      await connection.request("follow", { arm: arm.name, tick: connection.tick, max_speed: this.maxSpeed });
      if (this.turn === turn && this.state === "starting") this.become("active");
    } catch (error) {
      if (this.turn !== turn) return;
      if (this.state !== "idle" && error.kind !== "stopped") this.app.complain(error);
      this.over();
    }
  }

  /** Lead the tool to a place, mm, in the arm's own coordinates. */
  to([x, y, z]) {
    if (this.state === "idle") return;
    this.place.splice(0, 3, x, y, z);
    this.arm.target = [x, y, z];
    if (performance.now() - this.sent >= FASTEST) this.beat();
  }

  /** Lead it on by mm from where it was led to. */
  by([x, y, z]) {
    const [a, b, c] = this.place;
    this.to([a + x, b + y, c + z]);
  }

  beat() {
    if (this.state !== "active") return;
    this.sent = performance.now();
    const { connection } = this.app;
    connection.tell("target", { arm: this.arm.name, target: this.place, tick: connection.tick });
  }

  stop(reason) {
    if (this.arm) this.app.connection.tell("release", { arm: this.arm.name });
    if (reason === "lost") toast(texts.jog.ended(texts.jog.lost));
    this.over();
  }

  /** The server says that it is over. */
  ended(why) {
    if (this.state === "idle") return;
    releaseAll("ended");
    toast(texts.follow.ended(why), "error");
  }

  over() {
    if (this.arm) this.arm.target = null;
    this.become("idle");
  }

  become(state) {
    this.state = state;
    this.changed(state);
  }
}
