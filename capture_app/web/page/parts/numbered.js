// One step of several, with its number.
import { h } from "../core/dom.js";

/** @import {Child} from "../core/dom.js" */

/** @param {number} numeral @param {string} title @param {Child[]} content */
export function numbered(numeral, title, ...content) {
  return h(
    "section",
    { class: "part" },
    h("h2", {}, h("span", { class: "step-number", "aria-hidden": "true" }, String(numeral)), title),
    content,
  );
}
