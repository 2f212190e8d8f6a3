// Where each slot is shown in the picture: beside the others, or over them.

/** @typedef {{slot: number, x: number, y: number, width: number, height: number}} Pane */
/** @typedef {import("./vectors.js").Matrix} Matrix */

/** {slot, x, y, width, height} of each, in CSS pixels from the top left.
 *  @param {number[]} slots @param {string} arranged @param {number} width @param {number} height */
export function panesOf(slots, arranged, width, height) {
  const share = arranged === "over" ? 0 : width / Math.max(1, slots.length);
  return slots.map((slot, k) => ({ slot, x: k * share, y: 0, width: share || width, height }));
}

/** A pane in the canvas's own pixels. @param {Pane} pane @param {number} ratio */
export function pixels({ x, width, height }, ratio) {
  const left = Math.round(x * ratio);
  const right = Math.round((x + width) * ratio);
  return { x: left, y: 0, width: right - left, height: Math.round(height * ratio) };
}

/** Where a point of the world is in the picture, CSS pixels, and its depth (behind the eye below 0).
 *  @param {Matrix} m of the view and its projection @param {Pane} pane @param {number[]} place */
export function projected(m, pane, [x, y, z]) {
  const [right, up, , depth] = [0, 1, 2, 3].map((k) => m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k]);
  return {
    x: pane.x + ((right / depth + 1) / 2) * pane.width,
    y: ((1 - up / depth) / 2) * pane.height,
    depth,
  };
}
