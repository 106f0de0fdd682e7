// The page: one connection, one model of what the server says, and parts that show it.
//
//   socket -> Connection -> Model -> update(topic) of each part -> elements
//   elements -> app.act(what, values) -> Connection -> socket
//
// A part is a function that takes the app and returns {element, update(topic)}. Topics are the types of the server's messages
// about the arm that is shown, and "select" when another arm, or another description of it, is shown.

import { Connection } from "./connection.js";
import { confirm, toast } from "./dialogs.js";
import { Follower } from "./follower.js";
import { releaseAll } from "./hold.js";
import { Model } from "./model.js";
import { banners } from "./parts/banners.js";
import { header } from "./parts/header.js";
import { panels } from "./parts/panels.js";
import { readout } from "./parts/readout.js";
import { stopBar } from "./parts/stop.js";
import { viewport } from "./parts/viewport.js";
import { texts } from "./texts.js";

const ARM = "dobot-async arm";
const QUIET = new Set(["stopped"]); // an end that somebody asked for

class App {
  constructor() {
    this.texts = texts;
    this.model = new Model();
    this.parts = [];
    this.selected = sessionStorage.getItem(ARM) ?? "";
    this.connection = new Connection({
      receive: message => this.receive(message),
      changed: () => this.changed(),
      lostText: texts.connection.lostText,
    });
    this.follower = new Follower(this);
  }

  /** The arm that is shown. */
  get arm() {
    return this.model.arms.get(this.selected);
  }

  /** Whether this page may move the arm that is shown. */
  get mine() {
    return this.connection.state === "open" && Boolean(this.arm?.lease.mine);
  }

  get operator() {
    return this.model.role === "operator";
  }

  add(part, place) {
    this.parts.push(part);
    document.getElementById(place).append(part.element);
  }

  select(name) {
    releaseAll("another arm");
    this.selected = name;
    sessionStorage.setItem(ARM, name);
    this.update("select");
  }

  update(topic) {
    for (const part of this.parts) part.update(topic);
  }

  changed() {
    if (this.connection.state !== "open") {
      releaseAll("connection");
      for (const arm of this.model.arms.values()) arm.lease = { holder: null, mine: false };
    }
    this.update("connection");
  }

  receive(message) {
    const about = this.model.take(message);
    if (message.type === "hello") {
      if (!this.arm) this.selected = this.model.arms.keys().next().value ?? "";
      this.update("select");
    } else if (message.type === "arm") this.update(about === this.selected ? "select" : "arms");
    else if (about === this.selected || about === "") this.update(message.type);
    else if (about !== null) this.update("arms");
    if (message.type === "lease" && about === this.selected && !message.mine) releaseAll("lease");
  }

  /**
   * Ask the server to do something with the arm that is shown.
   * @returns {Promise<{ok: boolean, value?: any, error?: import("./connection.js").Failure}>} never rejected; failures are shown
   */
  async act(what, values = {}, { quiet = false } = {}) {
    try {
      return { ok: true, value: await this.connection.request(what, { arm: this.selected, ...values }) };
    } catch (error) {
      if (!quiet && !QUIET.has(error.kind)) this.complain(error);
      return { ok: false, error };
    }
  }

  /** Show what went wrong; that there is no connection is in a banner already. */
  complain(error) {
    if (error.kind === "link" && this.connection.state !== "open") return;
    toast(`${texts.errors[error.kind] ?? texts.errors.bug}: ${error.message}`, "error");
  }

  /** Like act, for a button that shows that it is at it. */
  async work(button, busy, what, values) {
    const before = [...button.childNodes];
    button.replaceChildren(busy);
    button.setAttribute("aria-busy", "true");
    button.disabled = true;
    const result = await this.act(what, values);
    button.replaceChildren(...before);
    button.removeAttribute("aria-busy");
    button.disabled = false;
    return result;
  }

  /** Take control of the arm that is shown; of somebody else only after asking. */
  async takeLease() {
    const { error } = await this.act("take_lease", { takeover: false }, { quiet: true });
    if (!error) return;
    const holder = this.arm?.lease.holder;
    if (error.kind !== "lease" || !holder) return this.complain(error);
    if (await confirm(texts.lease.takeoverTitle, texts.lease.takeoverText(holder), texts.lease.takeover)) await this.act("take_lease", { takeover: true });
  }
}

const app = new App();
app.add(header(app), "header");
app.add(banners(app), "banners");
app.add(viewport(app), "watch");
app.add(readout(app), "watch");
app.add(panels(app), "panels");
app.add(stopBar(app), "footer");
document.title = texts.title;
app.update("select");
app.update("connection");
