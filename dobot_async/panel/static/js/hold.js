// A control that is held: it acts from press to release, and it lives on beats.
//
//   press ----> start()            one at a time on the whole page
//   100 ms ---> beat()             only while the page can see that it is still held
//   release --> stop(reason)       also on a lost pointer, focus or page; asks for the stop, but is not what it depends on
//
// The server stops the arm when 300 ms pass without a beat. So the rule here is: no evidence, no beat.
//   pointer    the element still captures it, the page is visible and has the focus
//   key        the element has the focus, and the key went down, or repeated, less than a second ago
//   gamepad    the button that enables it was read as pressed in this very moment (see gamepad.js)

export const BEAT = 100; // ms
const KEY_BELIEVED = 1000; // ms; keyboards begin to repeat after 250 to 1000 ms
const KEYS = new Set([" ", "Enter"]);

let current = null;

/** End whatever is held. */
export function releaseAll(reason = "released") {
  current?.end(reason);
}

/** Whether something is held. */
export const holding = () => current !== null;

class Hold {
  constructor(held, actions) {
    this.held = held;
    this.actions = actions;
    this.timer = setInterval(() => (this.held() ? actions.beat() : this.end("lost")), BEAT);
    current = this;
    actions.start();
  }

  end(reason) {
    if (current !== this) return;
    current = null;
    clearInterval(this.timer);
    this.actions.stop(reason);
  }
}

const attended = () => !document.hidden && document.hasFocus();

/**
 * Begin to hold by evidence of one's own.
 * @param {() => boolean} held whether it is held now
 * @param {{start: () => void, beat: () => void, stop: (reason: string) => void}} actions
 * @returns {Hold|null} null while something else is held
 */
export function hold(held, actions) {
  return current ? null : new Hold(() => attended() && held(), actions);
}

/**
 * Make an element act while it is held by a pointer or a key.
 * @param {HTMLElement} element
 * @param {{start: (event: Event) => void, beat: () => void, stop: (reason: string) => void, move?: (event: PointerEvent) => void,
 *   ready?: (event: Event) => boolean, keys?: boolean}} actions ready: whether to begin; keys: false if keys do not hold it
 */
export function holdable(element, actions) {
  let mine = null;
  let pointer = null;
  let keyAt = 0;

  const ready = event => !current && !element.matches(":disabled") && actions.ready?.(event) !== false;

  const begin = (held, event) => {
    mine = hold(held, {
      start: () => { element.classList.add("held"); actions.start(event); },
      beat: actions.beat,
      stop: reason => { mine = null; pointer = null; element.classList.remove("held"); actions.stop(reason); },
    });
    if (mine) event.stopImmediatePropagation();
    return mine !== null;
  };

  element.addEventListener("pointerdown", event => {
    if (event.button !== 0 || !event.isPrimary || !ready(event)) return;
    event.preventDefault();
    element.focus({ preventScroll: true });
    element.setPointerCapture(event.pointerId);
    pointer = event.pointerId;
    begin(() => element.hasPointerCapture(event.pointerId), event);
  });
  element.addEventListener("pointermove", event => { if (mine && event.pointerId === pointer) actions.move?.(event); });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
    element.addEventListener(type, event => { if (mine && event.pointerId === pointer) mine.end("released"); });
  }
  if (actions.keys === false) return;
  element.addEventListener("keydown", event => {
    if (!KEYS.has(event.key)) return;
    event.preventDefault();
    keyAt = performance.now();
    if (!event.repeat && pointer === null && ready(event)) begin(() => document.activeElement === element && performance.now() - keyAt < KEY_BELIEVED, event);
  });
  element.addEventListener("keyup", event => { if (KEYS.has(event.key)) { event.preventDefault(); if (pointer === null) mine?.end("released"); } });
  element.addEventListener("blur", () => { if (pointer === null) mine?.end("lost"); });
  element.addEventListener("contextmenu", event => event.preventDefault());
}

addEventListener("blur", () => releaseAll("lost"));
addEventListener("pagehide", () => releaseAll("lost"));
document.addEventListener("visibilitychange", () => document.hidden && releaseAll("lost"));
