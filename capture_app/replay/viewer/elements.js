// Elements of a page, and small marks on them.

/** @typedef {string | number | boolean | null | undefined | ((event: Event) => void)} About */

/** element("button", {class: "x", text: "Play", onclick: f}, [children])
 *  @template {keyof HTMLElementTagNameMap} K @param {K} tag
 *  @param {Record<string, About>} about @param {(Node | string)[]} children */
export function element(tag, about = {}, children = []) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(about)) {
    if (typeof value === "function") made.addEventListener(name.slice(2), value);
    else if (name === "text") made.textContent = String(value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== null && value !== undefined && value !== false) {
      made.setAttribute(name, String(value));
    }
  }
  made.append(...children);
  return made;
}

/** @param {number} seconds */
export function clock(seconds) {
  const hundredths = Math.round(100 * seconds);
  const minutes = Math.floor(hundredths / 6000);
  const rest = ((hundredths - 6000 * minutes) / 100).toFixed(2);
  return minutes ? `${minutes}:${rest.padStart(5, "0")}` : `${rest} s`;
}
