// Lanes that show a value or a state over time, painted once for a size.

import { element } from "./elements.js";

/** @typedef {{lane: HTMLElement, at: (frame: number) => string}} Lane */
/** @typedef {{values: Float32Array, top: number, unit: string, label: string, kind: string}} Curve */

const HEIGHT = 30;
const KINDS = ["tl-good", "tl-limited", "tl-broken"];
const SVG = "http://www.w3.org/2000/svg";

/** @param {number} frames @param {string} label */
function drawing(frames, label) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", `0 0 ${frames} ${HEIGHT}`);
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", label);
  return svg;
}

/** @param {SVGElement} svg @param {string} tag @param {Record<string, string | number>} about */
function piece(svg, tag, about) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(about)) made.setAttribute(name, String(value));
  svg.append(made);
}

/** {lane, at(frame)}: `at` is the value in words. @param {Curve} curve @returns {Lane} */
export function curveLane({ values, top, unit, label, kind }) {
  const highest = values.reduce((high, value) => (value > high ? value : high), 0);
  const most = Math.max(top, highest);
  const svg = drawing(values.length, `${label}: at most ${told(highest, unit)}`);
  piece(svg, "path", { d: path(values, most), class: `tl-curve ${kind}` });
  const scale = element("span", { class: "tl-scale", text: told(most, unit), "aria-hidden": "true" });
  const lane = element("div", { class: "tl-lane" }, [svg, scale]);
  return { lane, at: (frame) => told(values[frame], unit) };
}

/** The tracking of each frame as bands.
 *  @param {{states: Uint8Array, names: string[], label: string}} bands @returns {Lane} */
export function bandLane({ states, names, label }) {
  const frames = states.length;
  const svg = drawing(frames, label);
  let start = 0;
  for (let f = 1; f <= frames; f++) {
    if (f < frames && states[f] === states[start]) continue;
    const place = { x: start, y: HEIGHT / 3, width: f - start, height: HEIGHT / 3 };
    piece(svg, "rect", { ...place, class: KINDS[states[start]] });
    start = f;
  }
  return { lane: element("div", { class: "tl-lane" }, [svg]), at: (frame) => names[states[frame]] };
}

/** @param {number} value @param {string} unit */
function told(value, unit) {
  if (!Number.isFinite(value)) return "unknown";
  return unit === "cm" ? `${(100 * value).toFixed(1)} cm` : `${value.toFixed(2)} ${unit}`;
}

/** What is not known breaks the line. @param {Float32Array} values @param {number} most */
function path(values, most) {
  let text = "";
  let begun = false;
  values.forEach((value, f) => {
    if (!Number.isFinite(value)) {
      begun = false;
      return;
    }
    const y = (HEIGHT - 2 - (HEIGHT - 4) * (value / most)).toFixed(2);
    text += `${begun ? "L" : "M"}${f + 0.5} ${y}`;
    begun = true;
  });
  return text;
}
