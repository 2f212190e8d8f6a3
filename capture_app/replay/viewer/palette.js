// Colours of the stage, red, green, blue from 0 to 1: those of the rendered videos, and a dark room.

/** @typedef {{background: number[], tile: number[], line: number, sky: number, ground: number, sun: number,
 *    sheen: number, phone: number[]}} Theme */

/** @type {{light: Theme, dark: Theme}} */
const THEMES = {
  light: {
    background: [0.925, 0.918, 0.905],
    tile: [0.895, 0.885, 0.868],
    line: -0.085,
    sky: 0.68,
    ground: 0.5,
    sun: 0.32,
    sheen: 0.05,
    phone: [0.2, 0.21, 0.23],
  },
  dark: {
    background: [0.078, 0.082, 0.094],
    tile: [0.15, 0.155, 0.17],
    line: 0.07,
    sky: 0.6,
    ground: 0.36,
    sun: 0.42,
    sheen: 0.12,
    phone: [0.42, 0.44, 0.48],
  },
};

/** By its name; "auto" is as the reader's other windows are. @param {string} name */
export function themeOf(name) {
  const auto = name === "auto" && matchMedia("(prefers-color-scheme: dark)").matches;
  return THEMES[auto || name === "dark" ? "dark" : "light"];
}

export const TINTS = [
  { body: [0.42, 0.56, 0.74], object: [0.87, 0.6, 0.33] },
  { body: [0.76, 0.5, 0.56], object: [0.82, 0.7, 0.45] },
  { body: [0.5, 0.64, 0.5], object: [0.72, 0.62, 0.5] },
  { body: [0.62, 0.55, 0.74], object: [0.7, 0.6, 0.42] },
];

export const LOST = [0.72, 0.7, 0.68];
export const FREE = [0.78, 0.79, 0.8];
export const HELD = [0.27, 0.68, 0.45];
export const MISSED = [0.86, 0.22, 0.18];
export const MARK = [0.95, 0.3, 0.5];
export const TRAIL = [0.8, 0.45, 0.22];
// By how well a frame was tracked: well, with limits, not at all.
export const TRACKING = [[0.2, 0.55, 0.86], [0.93, 0.66, 0.14], [0.86, 0.22, 0.18]];

/** @param {number[]} a @param {number[]} b @param {number} share */
export function blend(a, b, share) {
  return a.map((value, k) => value * (1 - share) + b[k] * share);
}
