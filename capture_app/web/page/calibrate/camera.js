// The numbers of a camera, for who has calibrated it; without them they are found from the film.
import { box, h, stacked } from "../core/dom.js";
import { field, number } from "../parts/fields.js";
/** @import {NumberAsked} from "../parts/fields.js" */

/** `pose`: also ask where it stood. {node, read() -> null or the camera} */
export function cameraFields({ pose = false } = {}) {
  /** @param {string} label @param {NumberAsked} more */
  const ask = (label, more = {}) => number(label, { unit: "px", min: 0, ...more });
  const fields = {
    fx: ask("fx"),
    fy: ask("fy"),
    cx: ask("cx"),
    cy: ask("cy"),
    width: ask("Width of the picture", { min: 16, step: 1 }),
    height: ask("Height of the picture", { min: 16, step: 1 }),
  };
  const lens = numbers("Distortion (k1 k2 p1 p2 k3), empty for none");
  const matrix = matrixField(
    "T_world_camera: its four rows of four numbers, metres",
    "In the world of the motion: z up, floor at 0; the camera's x right, y down, z ahead.",
  );
  const node = stacked(box("grid", Object.values(fields).map((one) => one.node)), lens.node, pose && matrix.node);
  const read = () => {
    const known = Object.fromEntries(Object.entries(fields).map(([key, one]) => [key, one.read()]));
    if (Object.values(known).some((value) => value === null)) return null;
    return { ...known, distortion: lens.read(), T_world_camera: pose ? matrix.read() : null };
  };
  return { node, read };
}

/** Sixteen numbers as four rows, or null. @param {string} label @param {string} hint */
export function matrixField(label, hint) {
  const input = h("textarea", { rows: 4 });
  const read = () => {
    const all = numbersIn(input.value);
    return all.length === 0 ? null : [0, 4, 8, 12].map((at) => all.slice(at, at + 4));
  };
  return { node: field(label, input, hint), read };
}

/** @param {string} label */
function numbers(label) {
  const input = h("input");
  return { node: field(label, input), read: () => numbersIn(input.value) };
}

/** @param {string} text */
function numbersIn(text) {
  return text
    .split(/[\s,]+/)
    .filter(Boolean)
    .map(Number);
}
