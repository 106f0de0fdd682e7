// A gamepad leads the arm: the sticks only while R1 is held, read anew for each picture of the screen, so never in a hidden tab.
//
//   R1 (5)        enables: let it go, and the arm stops
//   left stick    x and y        right stick    z
//   B (1)         stops all arms

import { hold } from "./hold.js";

const [ENABLE, STOP] = [5, 1];
const DEAD = 0.12; // of a stick's way, which is not looked at
const FRESH = 250; // ms; a reading that is older is none

/** A stick's way, without what it does when nobody touches it, finer near its middle. */
export function shaped(value) {
  const beyond = Math.max(Math.abs(value) - DEAD, 0) / (1 - DEAD);
  return Math.sign(value) * beyond ** 1.5;
}

export class Gamepads {
  /**
   * @param {object} app
   * @param {import("./follower.js").Follower} follower
   * @param {(name: string) => void} told the gamepad's name, "" while there is none
   */
  constructor(app, follower, told) {
    this.app = app;
    this.follower = follower;
    this.told = told;
    this.holding = null;
    this.enabled = false;
    this.readAt = 0;
    this.stopPressed = false;
    told("");
    addEventListener("gamepadconnected", () => this.look());
    addEventListener("gamepaddisconnected", () => { this.enabled = false; });
  }

  pad() {
    return navigator.getGamepads().find(each => each?.connected) ?? null;
  }

  look() {
    if (this.looking) return;
    this.looking = true;
    let before = performance.now();
    const each = now => {
      const pad = this.pad();
      this.told(pad?.id ?? "");
      if (!pad) {
        this.enabled = this.looking = false;
        return;
      }
      this.read(pad, Math.min((now - before) / 1000, 0.1));
      before = now;
      requestAnimationFrame(each);
    };
    requestAnimationFrame(each);
  }

  read(pad, seconds) {
    const stop = Boolean(pad.buttons[STOP]?.pressed);
    if (stop && !this.stopPressed) this.app.stop();
    this.stopPressed = stop;
    const enabled = Boolean(pad.buttons[ENABLE]?.pressed);
    const rose = enabled && !this.enabled;
    this.enabled = enabled;
    this.readAt = performance.now();
    const { follower } = this;
    if (rose && follower.able()) {
      this.holding = hold(() => this.enabled && performance.now() - this.readAt < FRESH, {
        start: () => follower.start(),
        beat: () => follower.beat(),
        stop: reason => { this.holding = null; follower.stop(reason); },
      });
    }
    if (!enabled) this.holding?.end("released");
    if (!this.holding || follower.state !== "active") return;
    const far = follower.maxSpeed * seconds;
    const [right, down, , lift] = pad.axes;
    follower.by([-shaped(down) * far, -shaped(right) * far, -shaped(lift ?? 0) * far]);
  }
}
