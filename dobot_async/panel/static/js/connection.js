// The socket to the server: requests with answers, messages without, and a new socket when the old one is gone.
//
//   {id, do, arm, ...} --->  <--- {type: "reply", id, ok, value | error: {kind, text}}
//
// A request that is under way when the socket ends fails: what a page commanded ends with its socket, and nothing is sent again.
// The one exception is a stop, which is kept and sent first when there is a socket again.

const SILENT = 4000; // ms; every arm's link is told once a second
const RETRY = [300, 700, 1500, 3000]; // ms
const STOP_AGAIN = 500; // ms

/** What the server, or the lack of one, says about a request. */
export class Failure extends Error {
  constructor(kind, text) {
    super(text);
    this.kind = kind;
  }
}

export class Connection {
  /**
   * @param {{receive: (message: object) => void, changed: (state: "connecting"|"open"|"lost"|"refused") => void, lostText: string}} hooks
   */
  constructor(hooks) {
    this.hooks = hooks;
    this.state = "connecting";
    this.tick = 0;
    this.waiting = new Map();
    this.number = 0;
    this.tries = 0;
    this.pendingStop = null;
    this.open();
    addEventListener("online", () => this.state !== "open" && this.open());
    addEventListener("offline", () => this.lose());
    addEventListener("pagehide", () => this.socket?.close());
    addEventListener("pageshow", event => event.persisted && this.state !== "open" && this.open());
  }

  open() {
    clearTimeout(this.retry);
    this.abandon();
    this.became("connecting");
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/ws`);
    this.socket = socket;
    socket.addEventListener("message", event => socket === this.socket && this.take(event.data));
    socket.addEventListener("close", () => socket === this.socket && this.lose());
    this.heard();
  }

  /** Leave the present socket. What it still says is not listened to. */
  abandon() {
    const socket = this.socket;
    this.socket = null;
    clearTimeout(this.silence);
    socket?.close();
    for (const { reject } of this.waiting.values()) reject(new Failure("link", this.hooks.lostText));
    this.waiting.clear();
  }

  lose() {
    this.abandon();
    this.became("lost");
    clearTimeout(this.retry);
    this.retry = setTimeout(() => this.again(), RETRY[Math.min(this.tries++, RETRY.length - 1)]);
  }

  /** Try again, unless the server no longer knows this browser. */
  async again() {
    try {
      const answer = await fetch("/", { cache: "no-store", redirect: "manual" });
      if (answer.status === 401 || answer.status === 403) return this.became("refused");
    } catch { /* not there: the socket will tell */ }
    if (this.state === "lost") this.open();
  }

  became(state) {
    if (this.state === state) return;
    this.state = state;
    this.hooks.changed(state);
  }

  heard() {
    clearTimeout(this.silence);
    this.silence = setTimeout(() => this.lose(), SILENT);
  }

  take(data) {
    this.heard();
    const message = JSON.parse(data);
    if (message.type === "tick") this.tick = message.n;
    else if (message.type === "reply") this.answer(message);
    else {
      if (message.type === "hello") {
        this.tries = 0;
        this.became("open");
        if (this.pendingStop) this.stop();
      }
      this.hooks.receive(message);
    }
  }

  answer({ id, ok, value, error }) {
    const request = this.waiting.get(id);
    if (!request) return;
    this.waiting.delete(id);
    if (ok) request.resolve(value);
    else request.reject(new Failure(error.kind, error.text));
  }

  /** Ask for something; the promise ends with its answer, or as a Failure. */
  request(what, values = {}) {
    if (this.state !== "open") return Promise.reject(new Failure("link", this.hooks.lostText));
    const id = ++this.number;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.post({ id, do: what, ...values });
    });
  }

  /** Say something that needs no answer. */
  tell(what, values = {}) {
    this.post({ do: what, ...values });
  }

  post(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** Stop all arms: said again until it is answered, and first of all on the next socket. */
  stop() {
    this.pendingStop ??= resolvers();
    const pending = this.pendingStop;
    clearTimeout(this.stopTimer);
    if (this.state === "open") {
      this.stopTimer = setTimeout(() => this.pendingStop === pending && this.stop(), STOP_AGAIN);
      this.request("stop").then(
        () => { this.forget(pending); pending.resolve(); },
        failure => { if (failure.kind !== "link") { this.forget(pending); pending.reject(failure); } },
      );
    }
    return pending.promise;
  }

  forget(pending) {
    if (this.pendingStop === pending) this.pendingStop = null;
  }
}

function resolvers() {
  const made = {};
  made.promise = new Promise((resolve, reject) => Object.assign(made, { resolve, reject }));
  return made;
}
