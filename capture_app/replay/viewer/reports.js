// The lane of what there is to look at: a flag where a check, or a fault of the motion, concerns a part of the take.

import { clock, element } from "./elements.js";
/** @import {Check, Header} from "./pack.js" */

/** A check that has a place. @typedef {Check & {start: number, stop: number}} Placed */

const LEAST = 0.012; // share of the lane that a flag takes at least
const ROWS = 3;
const WORDS = { bad: "Problem", warn: "Look here" };

/** What is told of the recording and of a sample. @param {Header} header @param {number} sample */
export function toldOf({ events, faults }, sample) {
  return [...events, ...(faults[sample] ?? [])];
}

/** null when nothing that is told has a place.
 *  @param {Header} header @param {number} sample @param {(check: Placed) => void} chosen */
export function reportLane(header, sample, chosen) {
  const placed = toldOf(header, sample).filter(isPlaced);
  if (!placed.length) return null;
  /** @type {number[]} */
  const ends = [];
  const flags = placed.map((event) => flag(event, header, ends, chosen));
  const lane = element("div", { class: "tl-lane tl-reports", role: "group" }, flags);
  lane.setAttribute("aria-label", `Report: ${placed.length} place${placed.length === 1 ? "" : "s"}`);
  lane.style.setProperty("--rows", String(Math.min(ROWS, ends.length)));
  return lane;
}

/** @param {Check} check @returns {check is Placed} */
export function isPlaced(check) {
  return check.start !== null;
}

/** @param {Placed} event @param {Header} header @param {number[]} ends where the last flag of each row ends
 *  @param {(check: Placed) => void} chosen */
function flag(event, { frames, fps }, ends, chosen) {
  const from = event.start / frames;
  const to = Math.max((event.stop + 1) / frames, from + LEAST);
  const free = ends.findIndex((end) => end <= from);
  const row = free >= 0 ? free : Math.min(ends.length, ROWS - 1);
  ends[row] = to;
  const made = element("button", {
    type: "button",
    class: `tl-flag tl-${event.severity}`,
    title: `${event.name}: ${event.message}`,
    "aria-label": `${WORDS[event.severity]} at ${clock(event.start / fps)}: ${event.name}, ${event.message}`,
    onclick: () => chosen(event),
  });
  made.style.left = `${100 * Math.min(from, 1 - LEAST)}%`;
  made.style.width = `${100 * (to - from)}%`;
  made.style.setProperty("--row", String(row));
  return made;
}
