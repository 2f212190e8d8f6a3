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

/** What is known of the place and the direction, in sentences. @param {Bounds | null} bounds */
export function sureWords(bounds) {
  if (!bounds) return ["How sure it is is not known."];
  return [
    `The phone's place on the object is sure to ± ${few(bounds.mm)} mm; hands need ± ${FAR.mm} mm.`,
    `Its direction is sure to ± ${few(bounds.deg)}°; hands need ± ${FAR.deg}°.`,
    "Both are true 95 times of 100, if the numbers it was made from are right.",
  ];
}

/** What a calibration left over, as a sentence around the number; `good`: up to where it is a good one.
 *  @type {Record<string, {words: string, unit?: string, good?: number}>} */
const FITS = {
  rms_mm: { words: "What was measured fits to # on average", unit: "mm", good: 5 },
  worst_mm: { words: "The point that fits worst is # off", unit: "mm", good: 5 },
  rms_deg: { words: "Its directions fit to # on average", unit: "°", good: 1 },
  "world held still_mm": { words: "With the phone's drift left in it fits to #", unit: "mm" },
  "world held still_deg": { words: "Its directions fit to # then", unit: "°" },
  "drift taken out_m": { words: "The phone drifted by # in all, which is taken out", unit: "m" },
  "drift per metre walked_mm": { words: "It drifted by # for each metre walked", unit: "mm", good: 7 },
  "phone's lengths too short by_%": {
    words: "The phone took lengths for # shorter than they are",
    unit: "%",
  },
  "moments used_%": { words: "# of the recording were used", unit: "%" },
  corners_px: { words: "Corners of the board are found to # of the film", unit: "pixels", good: 1 },
  "board place_mm": { words: "The place of the board on the object fits to #", unit: "mm", good: 5 },
  board_mm: { words: "Views of the board agree to #", unit: "mm", good: 5 },
  board_deg: { words: "Their directions agree to #", unit: "°", good: 1 },
  stills_mm: { words: "Pictures of the rest agree to #", unit: "mm", good: 5 },
  stills_deg: { words: "Their directions agree to #", unit: "°", good: 1 },
  scan_mm: { words: "The scan and the object's mesh fit to #", unit: "mm", good: 5 },
  "scan_seen_%": { words: "# of the scan lie on the mesh", unit: "%" },
  reprojection_px: { words: "What was recognised is found again to # of a picture", unit: "pixels", good: 2 },
  views_mm: { words: "Pictures of the phone agree to #", unit: "mm", good: 5 },
  views_deg: { words: "Their directions agree to #", unit: "°", good: 1 },
  floor_tilt_deg: { words: "The object stands within # of upright where it rests", unit: "°", good: 1 },
  floor_height_mm: { words: "It stands within # of the floor there", unit: "mm", good: 10 },
  inliers: { words: "# points were found again" },
};

/** A residual of a calibration in plain words; "" for what tells only programs.
 *  @param {string} key @param {number} value */
export function fitWords(key, value) {
  const { words, unit = "", good } = FITS[key] ?? { words: "" };
  if (!words) return "";
  const size = unit ? `${few(value)}${unit === "°" ? "" : " "}${unit}` : String(Math.round(value));
  const bound = good ? `; a good fit is under ${good}${unit === "°" ? unit : ` ${unit}`}` : "";
  return `${words.replace("#", size)}${bound}.`;
}

/** Whether hands may be clearly off the object. @param {Bounds | null} bounds */
export function isFar(bounds) {
  return bounds !== null && (bounds.mm > FAR.mm || bounds.deg > FAR.deg);
}
