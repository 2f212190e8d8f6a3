// Vectors, rotations and 4 x 4 matrices (column by column, as WebGL takes them). World: z up, metres.

/** Numbers of which the first are meant: of a vector, a quaternion, a whole array of them.
 *  @typedef {ArrayLike<number>} Vector */
/** Sixteen numbers. @typedef {ArrayLike<number>} Matrix */

/** @type {(a: Vector, b: Vector) => number[]} */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @type {(a: Vector, b: Vector) => number[]} */
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @type {(a: Vector, s: number) => number[]} */
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @type {(a: Vector, b: Vector) => number} */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @type {(a: Vector) => number} */
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
/** @type {(a: Vector, b: Vector) => number[]} */
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** @param {Vector} a */
export function unit(a) {
  const length = norm(a);
  return length > 1e-12 ? scaled(a, 1 / length) : [0, 0, 1];
}

/** @param {Matrix} a @param {Matrix} b */
export function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

/** A frame with these axes and this origin.
 *  @param {number[]} x @param {number[]} y @param {number[]} z @param {number[]} p */
export function frame(x, y, z, p) {
  return new Float32Array([...x, 0, ...y, 0, ...z, 0, ...p, 1]);
}

/** @param {number[]} p @param {number} size */
export function placed(p, size = 1) {
  return frame([size, 0, 0], [0, size, 0], [0, 0, size], p);
}

/** @param {number[]} q of unit length: x, y, z, w @param {number[]} p */
export function pose(q, p) {
  const [x, y, z, w] = q;
  return frame(
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
    p,
  );
}

/** @param {Matrix} T @param {Vector} p */
export function point(T, p) {
  return [0, 1, 2].map((k) => T[k] * p[0] + T[4 + k] * p[1] + T[8 + k] * p[2] + T[12 + k]);
}

/** @param {Matrix} T @param {Vector} d */
export function direction(T, d) {
  return [0, 1, 2].map((k) => T[k] * d[0] + T[4 + k] * d[1] + T[8 + k] * d[2]);
}

/** Of a rotation with a translation. @param {Matrix} T */
export function rigidInverse(T) {
  const axes = [0, 1, 2].map((row) => [T[row], T[4 + row], T[8 + row]]);
  const p = [T[12], T[13], T[14]];
  const moved = [0, 1, 2].map((k) => -(T[4 * k] * p[0] + T[4 * k + 1] * p[1] + T[4 * k + 2] * p[2]));
  return frame(axes[0], axes[1], axes[2], moved);
}

/** A camera (x right, y up, looking along -z) at `eye` that looks at `target` with a level horizon.
 *  @param {number[]} eye @param {number[]} target */
export function lookAt(eye, target) {
  const back = unit(sub(eye, target));
  const level = cross([0, 0, 1], back);
  const right = norm(level) > 1e-6 ? unit(level) : [1, 0, 0];
  return frame(right, cross(back, right), back, eye);
}

/** @param {number} fovY @param {number} aspect @param {number} near @param {number} far */
export function perspective(fovY, aspect, near, far) {
  const f = 1 / Math.tan(fovY / 2);
  const out = new Float32Array(16);
  out[0] = f / aspect;
  out[5] = f;
  out[10] = (far + near) / (near - far);
  out[11] = -1;
  out[14] = (2 * far * near) / (near - far);
  return out;
}

/** A box of `radius` across and `depth` deep around the origin, seen along -z.
 *  @param {number} radius @param {number} depth */
export function parallel(radius, depth) {
  const out = placed([0, 0, 0]);
  out[0] = out[5] = 1 / radius;
  out[10] = -1 / depth;
  return out;
}

/** Any frame whose z is this direction.
 *  @param {number[]} z @param {number[]} p @param {number} size @param {number} thickness */
export function facing(z, p, size, thickness) {
  const along = unit(z);
  const aside = Math.abs(along[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0];
  const x = unit(cross(aside, along));
  return frame(scaled(x, size), scaled(cross(along, x), size), scaled(along, thickness), p);
}

/** Between two quaternions that lie near each other, in arrays of any number type.
 *  @param {Vector} array @param {number} a @param {number} b @param {number} mix */
export function between(array, a, b, mix) {
  const q = [0, 1, 2, 3].map((k) => array[a + k] * (1 - mix) + array[b + k] * mix);
  const length = Math.hypot(...q) || 1;
  return q.map((value) => value / length);
}

/** @param {Vector} array @param {number} a @param {number} b @param {number} mix */
export function mixed(array, a, b, mix) {
  return [0, 1, 2].map((k) => array[a + k] * (1 - mix) + array[b + k] * mix);
}
