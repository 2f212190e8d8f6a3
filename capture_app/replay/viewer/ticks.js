// Where the timeline says which second it is.

const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600];
const LONGEST = 1200;
const MOST = 12;

/** Seconds from 0 to `duration`, evenly apart, and few enough to be read.
 *  @param {number} duration */
export function tickSeconds(duration) {
  const step = STEPS.find((size) => duration / size <= MOST) ?? LONGEST;
  // What is divided need not come out whole.
  const last = Math.floor(duration / step + 1e-6);
  return Array.from({ length: last + 1 }, (_, k) => k * step);
}
