// How a mount was found and how sure it is, in words.
/** @import {Bounds, Mount} from "../core/answers.js" */

/** @type {Record<string, string>} */
const METHODS = {
  board: "a board and a second camera",
  session: "scan and clamp in one recording",
  scan: "a scan that shows the phone",
  screen: "pictures of the phone's screen",
  tracker: "motion capture",
  drawing: "numbers of a drawing",
  points: "points on phone and object",
  floor: "standing on the floor",
  combine: "several calibrations",
  identity: "taken as the phone itself",
};

/** How a mount was found, and within what it is true 95 times of 100. @param {Mount} mount */
export function mountWords(mount) {
  const way = METHODS[mount.method] ?? mount.method;
  if (mount.method === "identity") return way;
  return `by ${way}, ${boundWords(mount.bounds)}`;
}

/** In words. @param {Bounds | null} bounds */
export function boundWords(bounds) {
  if (!bounds) return "error unknown";
  return `within ${few(bounds.mm)} mm and ${few(bounds.deg)}°`;
}

/** A number with decimals where they say something. @param {number} value */
export function few(value) {
  return value.toFixed(value < 0.1 ? 2 : value < 10 ? 1 : 0);
}

// Beyond these, hands may be clearly off the object.
const FAR = { mm: 20, deg: 3 };

/** Whether hands may be clearly off the object. @param {Bounds | null} bounds */
export function isFar(bounds) {
  return bounds !== null && (bounds.mm > FAR.mm || bounds.deg > FAR.deg);
}
