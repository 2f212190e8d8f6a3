// What the user knows of a recording that its log does not say, or not rightly.
import { h, stacked } from "../core/dom.js";
import { choice, field } from "./fields.js";
/** @import {Field} from "./fields.js" */

const DIRECTION = "direction";
const NUMBER = String.raw`\s*[\-+]?(\d+\.?\d*|\.\d+)\s*`;
const AXES = ["x", "y", "z", "-x", "-y", "-z"];

/** What is said in them, as the query of a report has it. @param {Record<string, Field<any>>} fields */
export function readingQuery(fields) {
  return Object.entries(fields).flatMap(([name, one]) => {
    const value = one.read();
    return value === null || value === false ? [] : [[name, String(value)]];
  });
}

/** The way up: an axis of the mesh, or a direction. @returns {Field<any>} */
export function upField() {
  const which = choice(
    "Which way is up",
    [
      ["", "as the log says, or found"],
      ...AXES.map((axis) => [`object:${axis}`, `along ${axis} of the mesh where the object rests`]),
      [DIRECTION, "a direction in the phone's world"],
    ],
    { hint: "Where the log does not say it." },
  );
  const input = h("input", { type: "text", placeholder: "0,1,0", pattern: `${NUMBER},${NUMBER},${NUMBER}` });
  const typed = field("Direction of up", input, "Three numbers in the phone's world, e.g. 0,1,0.");
  const show = () => {
    typed.hidden = which.read() !== DIRECTION;
    input.disabled = typed.hidden;
    input.required = !typed.hidden;
  };
  which.input.addEventListener("change", show);
  show();
  const direction = () => (input.value && input.checkValidity() ? input.value.split(",").map(Number) : null);
  const read = () => (which.read() === DIRECTION ? direction() : which.read() || null);
  return { node: stacked(which.node, typed), input: which.input, read };
}
