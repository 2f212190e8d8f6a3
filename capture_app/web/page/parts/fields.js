// Form fields with their labels and hints, and a button that waits for what it does.
import { inWords } from "../core/api.js";
import { box, freshId, h, put } from "../core/dom.js";
import { trouble } from "./trouble.js";
/** @import {Described} from "../core/answers.js"
 *  @import {Props} from "../core/dom.js" */

/** A field of a form and what it says. @template V @template {HTMLElement} [I=HTMLElement]
 *  @typedef {{node: HTMLElement, input: I, read: () => V}} Field */
/** @typedef {Field<number | null, HTMLInputElement>} NumberField */
/** @typedef {Field<string, HTMLSelectElement>} Choice */
/** @typedef {Field<boolean, HTMLInputElement>} Tick */
/** @typedef {{value?: number | string, min?: number, max?: number, step?: number | string,
 *    unit?: string, hint?: string, required?: boolean}} NumberAsked */

/** A labelled field around an input or select.
 *  @param {string} label @param {HTMLElement} input */
export function field(label, input, hint = "") {
  const id = freshId("hint");
  if (hint) input.setAttribute("aria-describedby", id);
  return box("field", h("label", {}, h("span", {}, label), input), hint && h("p", { class: "hint", id }, hint));
}

/** A number field; `unit` stands behind it.
 *  @param {string} label @param {NumberAsked} asked @returns {NumberField} */
export function number(label, { value = "", min, max, step = "any", unit = "", hint = "", required = false }) {
  const input = h("input", {
    type: "number",
    value: String(value),
    min,
    max,
    step,
    required,
    inputmode: "decimal",
  });
  const id = freshId("field");
  input.id = id;
  const hintId = freshId("hint");
  if (hint) input.setAttribute("aria-describedby", hintId);
  const node = box(
    "field",
    h("label", { for: id }, h("span", {}, unit ? `${label} (${unit})` : label)),
    input,
    hint && h("p", { class: "hint", id: hintId }, hint),
  );
  return { node, input, read: () => (input.value === "" ? null : input.valueAsNumber) };
}

/** A choice from [[value, words]].
 *  @param {string} label @param {string[][]} options
 *  @param {{value?: string, hint?: string}} asked @returns {Choice} */
export function choice(label, options, { value = options[0]?.[0], hint = "" } = {}) {
  const input = h("select", {}, options.map(([key, words]) => h("option", { value: key }, words)));
  if (value !== undefined) input.value = value;
  return { node: field(label, input, hint), input, read: () => input.value };
}

/** Fields by kinds, as the API describes them. @type {Record<string, (one: Described) => Field<any>>} */
const KINDS = {
  number: (one) => number(one.title, one),
  tick: (one) => tick(one.title, { checked: one.value, hint: one.hint }),
  choice: (one) => {
    const made = choice(one.title, one.options, one);
    return { ...made, read: () => made.read() || null };
  },
  text: ({ title, value = "", hint }) => {
    const input = h("input", { type: "text", value });
    return { node: field(title, input, hint), input, read: () => input.value || null };
  },
};

/** The fields of a form by name; `own` are made in another way. What neither makes is left out.
 *  @param {Described[]} form @param {Record<string, Field<any>>} own @returns {Record<string, Field<any>>} */
export function describedFields(form, own = {}) {
  const made = form.map((one) => [one.name, own[one.name] ?? KINDS[one.kind]?.(one)]);
  return Object.fromEntries(made.filter(([, one]) => one));
}

/** What fields say, by name. @param {Record<string, {read: () => unknown}>} fields */
export function saidIn(fields) {
  return Object.fromEntries(Object.entries(fields).map(([name, one]) => [name, one.read()]));
}

/** Fields side by side. @param {Record<string, {node: HTMLElement}>} fields */
export function grid(fields) {
  return box("grid", Object.values(fields).map(({ node }) => node));
}

/** A button that does something at once; `more` of its attributes.
 *  @param {string} words @param {() => void} click @param {Props} more */
export function button(words, click, more = {}) {
  return h("button", { type: "button", on: { click }, ...more }, words);
}

/** A box to tick.
 *  @param {string} label @param {{checked?: boolean, hint?: string}} asked @returns {Tick} */
export function tick(label, { checked = false, hint = "" } = {}) {
  const input = h("input", { type: "checkbox", checked });
  const id = freshId("hint");
  if (hint) input.setAttribute("aria-describedby", id);
  const node = box(
    "field",
    h("label", { class: "tick" }, input, h("span", {}, label)),
    hint && h("p", { class: "hint", id }, hint),
  );
  return { node, input, read: () => input.checked };
}

/** A button that is busy while `act` runs, and shows what went wrong in `place`.
 *  @param {string} words @param {() => Promise<unknown>} act
 *  @param {{kind?: string, place?: HTMLElement | null}} look */
export function doing(words, act, { kind = "", place = null } = {}) {
  const made = h("button", { type: "button", class: kind }, words);
  made.addEventListener("click", () => attempt(made, place, act));
  return made;
}

/** What a form does when it is sent: `act`, once, with its button waiting and an error in `place`.
 *  @param {HTMLElement} pressed @param {HTMLElement} place @param {() => Promise<unknown>} act */
export function sends(pressed, place, act) {
  const submit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    attempt(pressed, place, act);
  };
  return { on: { submit, change: () => put(place) } };
}

/** Run `act` once: the button that was pressed waits, an error is shown in `place`. Returns what
 *  `act` returned.
 *  @template T @param {HTMLElement} pressed @param {HTMLElement | null} place
 *  @param {() => Promise<T>} act @returns {Promise<T | undefined>} */
export async function attempt(pressed, place, act) {
  pressed.setAttribute("aria-disabled", "true");
  if (pressed.dataset.busy) return undefined;
  pressed.dataset.busy = "yes";
  if (place) put(place);
  try {
    return await act();
  } catch (error) {
    if (error instanceof Error && error.name === "AbortError") return undefined;
    if (place) put(place, trouble(inWords(error)));
    return undefined;
  } finally {
    delete pressed.dataset.busy;
    pressed.removeAttribute("aria-disabled");
  }
}
