// What the user knows of a recording that its log does not say, or not rightly.
import { h } from "../core/dom.js";
import { choice, field, number, tick } from "./fields.js";

/** A field of which only what it says matters. @typedef {{node: HTMLElement, read: () => unknown}} Said */

const DIRECTION = "direction";
const NUMBER = String.raw`\s*[\-+]?(\d+\.?\d*|\.\d+)\s*`;
const AXES = ["x", "y", "z", "-x", "-y", "-z"];

/** Which app recorded it, found out unless chosen: {node, read()}. formats: names of apps.
 *  @param {string[]} formats */
export function formatField(formats) {
  const known = formats.map((name) => [name, name]);
  const app = choice("Recorded with", [["", "found by what it holds"], ...known]);
  return { ...app, read: () => app.read() || null };
}

/** Fields by the names of the options of a run: {node, read()}. formats: names of apps.
 *  @param {string[]} formats */
export function readingFields(formats) {
  return {
    floor: number("Height of the floor", {
      unit: "m",
      hint: "In the phone's world, 0 where the recording began. Empty: where the object rests.",
    }),
    up: up(),
    segment: number("Stretch to use", {
      min: 1,
      step: 1,
      hint: "Where tracking failures split the recording. Empty: the longest.",
    }),
    format: formatField(formats),
    stitch: tick("Put tracking jumps back together", {
      hint: "Instead of splitting the recording there.",
    }),
    closure: tick("The object ends on the mark where it began", {
      hint: "Takes the drift in between out.",
    }),
  };
}

/** What is said in them, as the query of a report has it. @param {Record<string, Said>} fields */
export function readingQuery(fields) {
  return Object.entries(fields).flatMap(([name, one]) => {
    const value = one.read();
    return value === null || value === false ? [] : [[name, String(value)]];
  });
}

function up() {
  const which = choice(
    "Which way is up",
    [
      ["", "as the log says, or found"],
      ...AXES.map((axis) => [`object:${axis}`, `along ${axis} of the mesh where the object rests`]),
      [DIRECTION, "a direction in the phone's world"],
    ],
    { hint: "Where the log does not say it." },
  );
  const input = h("input", {
    type: "text",
    placeholder: "0,1,0",
    pattern: `${NUMBER},${NUMBER},${NUMBER}`,
  });
  const typed = field("Direction of up", input, "Three numbers in the phone's world, e.g. 0,1,0.");
  const show = () => {
    typed.hidden = which.read() !== DIRECTION;
    input.disabled = typed.hidden;
    input.required = !typed.hidden;
  };
  which.input.addEventListener("change", show);
  show();
  const direction = () =>
    input.value && input.checkValidity() ? input.value.split(",").map(Number) : null;
  const read = () => (which.read() === DIRECTION ? direction() : which.read() || null);
  return { node: h("div", { class: "stack" }, which.node, typed), read };
}
