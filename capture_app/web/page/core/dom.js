// Elements from data: no string of HTML is ever parsed, so nothing a name holds can become markup.

const SVG = "http://www.w3.org/2000/svg";

/** Nodes, text, arrays of them, and null or false for nothing.
 *  @typedef {Node | string | number | boolean | null | undefined | Child[]} Child */
/** @typedef {{[K in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[K]) => void}} Heard */
/** Attributes, `on: {event: handler}`, `style: {property: value}`, or properties of the element
 *  (value, checked, disabled, hidden, ...).
 *  @typedef {Record<string, string | number | boolean | null | undefined | Heard
 *    | Record<string, string>> & {on?: Heard, style?: Record<string, string>}} Props */

/** An element.
 *  @template {keyof HTMLElementTagNameMap} K @param {K} tag @param {Props} props
 *  @param {Child[]} children */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(props)) set(element, key, value);
  fill(element, children);
  return element;
}

/** @param {string} look its classes @param {Child[]} children */
export const box = (look, ...children) => h("div", { class: look }, children);

/** @param {Child[]} children */
export const inRow = (...children) => box("row", children);

/** @param {Child[]} children */
export const stacked = (...children) => box("stack", children);

/** A link that looks like a button. @param {string} href @param {Child[]} children */
export const goTo = (href, ...children) => h("a", { class: "button", href }, children);

/** A button that does something at once. @param {string} look its classes @param {() => void} click
 *  @param {Child[]} children */
export const action = (look, click, ...children) =>
  h("button", { type: "button", class: look, on: { click } }, children);

/** A line that explains. @param {Child[]} children */
export const hintLine = (...children) => h("p", { class: "hint" }, children);

/** What is shown when its title is clicked. @param {Child} title @param {Child[]} children */
export const folded = (title, ...children) => h("details", {}, h("summary", {}, title), children);

/** Names and values; a value that is not known is a dash. @param {unknown[][]} facts */
export const factList = (facts) =>
  h(
    "dl",
    { class: "facts" },
    facts.map(([key, value]) => h("div", {}, h("dt", {}, String(key)), h("dd", {}, String(value ?? "–")))),
  );

/** A part of a page with its heading. @param {string} title @param {Child[]} children */
export const part = (title, ...children) => h("section", {}, h("h2", {}, title), children);

/** The same on a card. @param {string} title @param {Child[]} children */
export const card = (title, ...children) => h("section", { class: "card stack" }, h("h2", {}, title), children);

/** An element of a picture.
 *  @param {string} tag @param {Record<string, string | number>} attributes @param {Child[]} children */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  fill(element, children);
  return element;
}

/** Put these children in place of those that are there.
 *  @template {Element} E @param {E} element @param {Child[]} children */
export function put(element, ...children) {
  element.replaceChildren();
  fill(element, children);
  return element;
}

/** Set text only when it changes, so that screen readers and selections are left alone.
 *  @param {Element} element @param {string} text */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let made = 0;

/** An id that no other element has, to tie a label to its field. @param {string} word */
export function freshId(word) {
  made += 1;
  return `${word}-${made}`;
}

/** @param {HTMLElement} element @param {string} key @param {Props[string]} value */
function set(element, key, value) {
  if (value === null || value === undefined) return;
  if (typeof value === "object") {
    for (const [name, one] of Object.entries(value)) {
      if (typeof one === "function") element.addEventListener(name, one);
      else element.style.setProperty(name, one);
    }
  } else if (key === "class") {
    element.className = String(value);
  } else if ((typeof value === "boolean" && key in element) || key === "value") {
    Reflect.set(element, key, value);
  } else {
    element.setAttribute(key, String(value));
  }
}

/** @param {Element} element @param {Child[]} children */
function fill(element, children) {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    if (Array.isArray(child)) fill(element, child);
    else element.append(child instanceof Node ? child : String(child));
  }
}

/** The element of the page itself with this id. @param {string} id */
export function here(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no ${id}`);
  return found;
}

let last = "";

/** Say a sentence once, politely. @param {string} sentence */
export function announce(sentence) {
  if (sentence === last) return;
  last = sentence;
  here("live").textContent = sentence;
}

/** @param {number} numeral @param {string} title @param {Child[]} content */
export function numbered(numeral, title, ...content) {
  return h(
    "section",
    { class: "part" },
    h("h2", {}, h("span", { class: "step-number", "aria-hidden": "true" }, String(numeral)), title),
    content,
  );
}
