// Elements from data: no string of HTML is ever parsed, so nothing a name holds can become markup.

const SVG = "http://www.w3.org/2000/svg";

/** An element. `props`: attributes, `on: {event: handler}`, `style: {property: value}`, or
 *  properties of the element (value, checked, disabled, hidden, ...). Children: nodes, text, arrays,
 *  and null or false for nothing. */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(props ?? {})) set(element, key, value);
  fill(element, children);
  return element;
}

/** An element of a picture. */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  fill(element, children);
  return element;
}

/** Put these children in place of those that are there. */
export function put(element, ...children) {
  element.replaceChildren();
  fill(element, children);
  return element;
}

/** Set text only when it changes, so that screen readers and selections are left alone. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let made = 0;

/** An id that no other element has, to tie a label to its field. */
export function freshId(word) {
  made += 1;
  return `${word}-${made}`;
}

function set(element, key, value) {
  if (value === null || value === undefined) return;
  if (key === "on") {
    for (const [event, handler] of Object.entries(value)) element.addEventListener(event, handler);
  } else if (key === "style") {
    for (const [name, text] of Object.entries(value)) element.style.setProperty(name, text);
  } else if (key === "class") {
    element.className = value;
  } else if (typeof value === "boolean" && key in element) {
    element[key] = value;
  } else if (key === "value" || key === "srcObject") {
    element[key] = value;
  } else {
    element.setAttribute(key, value);
  }
}

function fill(element, children) {
  for (const child of children.flat(Infinity)) {
    if (child === null || child === undefined || child === false) continue;
    element.append(child instanceof Node ? child : String(child));
  }
}
