// Makes elements. Text always goes in as text, so nothing that a server or a file says can become markup.

/**
 * Make an element.
 * @param {string} tag such as "button", with classes behind dots: "button.primary"
 * @param {object} properties attributes; "on" is a table of event listeners; undefined, null and false are left out
 * @param {...(Node|string|number|null|undefined|false)} children
 */
export function el(tag, properties = {}, ...children) {
  const [name, ...classes] = tag.split(".");
  const element = document.createElement(name);
  if (classes.length) element.className = classes.join(" ");
  for (const [key, value] of Object.entries(properties)) {
    if (key === "on") for (const [event, listener] of Object.entries(value)) element.addEventListener(event, listener);
    else if (value !== undefined && value !== null && value !== false) element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat().filter(child => child !== null && child !== undefined && child !== false));
  return element;
}

/** Replace all children. */
export function fill(element, ...children) {
  element.replaceChildren(...children.flat().filter(child => child !== null && child !== undefined && child !== false));
}

/** Set a text only where it changes, so that screen readers and layout are left alone. */
export function say(element, text) {
  const words = String(text);
  if (element.textContent !== words) element.textContent = words;
}

/** Set or remove an attribute only where it changes. */
export function mark(element, name, value) {
  if (value === false || value === null || value === undefined) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
  } else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, String(value));
}

let fields = 0;

/** A labelled input: {label, input}, the label around the unit too. */
export function field(label, properties = {}, unit = "") {
  const id = `field-${++fields}`;
  const input = el("input", { id, autocomplete: "off", ...properties });
  const row = el("div.field", {}, el("label", { for: id }, label), el("span.entry", {}, input, unit && el("span.unit", { "aria-hidden": "true" }, unit)));
  return { row, input };
}

/** A number field; value() is undefined while it is empty, NaN for what is no number. */
export function number(label, unit, properties = {}) {
  const { row, input } = field(label, { type: "number", inputmode: "decimal", step: "any", ...properties }, unit);
  return {
    row, input,
    value: () => (input.validity.badInput ? NaN : input.value === "" ? undefined : Number(input.value)),
    set: value => { input.value = value === undefined || value === null ? "" : String(Math.round(value * 100) / 100); },
  };
}

/** A choice of a few, as radio buttons in a row. Its legend is seen only if it is titled. */
export function choice(legend, options, chosen, changed, { titled = false } = {}) {
  const name = `field-${++fields}`;
  const inputs = new Map();
  const row = el("fieldset.choice", {}, el("legend", { class: titled ? null : "visually-hidden" }, legend), options.map(([value, label]) => {
    const input = el("input", { type: "radio", name, value, on: { change: () => input.checked && changed(value) } });
    input.checked = value === chosen;
    inputs.set(value, input);
    return el("label", {}, input, el("span", {}, label));
  }));
  return { row, set: value => { const input = inputs.get(value); if (input) input.checked = true; } };
}

/** A button. */
export function button(label, pressed, properties = {}) {
  return el("button", { type: "button", ...properties, on: { click: pressed, ...properties.on } }, label);
}

/** Numbers for people. */
export const fixed = (value, digits = 1) => (Number.isFinite(value) ? value.toFixed(digits).replace("-", "−") : "–");
