import assert from "node:assert/strict";
import test from "node:test";

import * as vectors from "../../capture_app/replay/viewer/vectors.js";
import { near } from "./near.js";

const { cross, direction, dot, facing, lookAt, multiply, norm, perspective, point, pose } = vectors;
const HALF = Math.SQRT1_2;
const QUARTER_ABOUT_Z = [0, 0, HALF, HALF];

/** What a projection makes of a point, divided by its depth. */
function seen(projection, [x, y, z]) {
  const row = (k) =>
    projection[k] * x + projection[4 + k] * y + projection[8 + k] * z + projection[12 + k];
  return [row(0) / row(3), row(1) / row(3), row(2) / row(3)];
}

test("the cross product is square to both and follows the right hand", () => {
  near(cross([1, 0, 0], [0, 1, 0]), [0, 0, 1]);
  const [a, b] = [
    [1, 2, 3],
    [-4, 5, 0.5],
  ];
  near([dot(cross(a, b), a), dot(cross(a, b), b)], [0, 0]);
});

test("a unit vector has length 1; that of nothing is up", () => {
  near(vectors.unit([0, -3, 4]), [0, -0.6, 0.8]);
  near(vectors.unit([0, 0, 0]), [0, 0, 1]);
});

test("a quarter turn about z brings x to y, and the place is added", () => {
  const T = pose(QUARTER_ABOUT_Z, [10, 20, 30]);
  near(point(T, [1, 0, 0]), [10, 21, 30]);
  near(point(T, [0, 1, 0]), [9, 20, 30]);
  near(direction(T, [1, 0, 0]), [0, 1, 0]);
});

test("a quarter turn about x brings y to z, about y it brings z to x", () => {
  near(direction(pose([HALF, 0, 0, HALF], [0, 0, 0]), [0, 1, 0]), [0, 0, 1]);
  near(direction(pose([0, HALF, 0, HALF], [0, 0, 0]), [0, 0, 1]), [1, 0, 0]);
});

test("a pose of any unit quaternion is a rotation", () => {
  const T = pose([0.1, -0.5, 0.7, Math.sqrt(1 - 0.01 - 0.25 - 0.49)], [0, 0, 0]);
  const axes = [0, 4, 8].map((at) => Array.from(T.subarray(at, at + 3)));
  near(axes.map(norm), [1, 1, 1]);
  near(cross(axes[0], axes[1]), axes[2]);
});

test("a product of matrices does one after the other", () => {
  const A = pose(QUARTER_ABOUT_Z, [1, 2, 3]);
  const B = pose([0.6, 0, 0, 0.8], [-2, 0.5, 4]);
  near(point(multiply(A, B), [3, -1, 2]), point(A, point(B, [3, -1, 2])), 1e-5);
});

test("the inverse of a pose undoes it", () => {
  const T = pose([0.36, 0.48, 0, 0.8], [1, -2, 3]);
  near(multiply(T, vectors.rigidInverse(T)), pose([0, 0, 0, 1], [0, 0, 0]));
  near(multiply(vectors.rigidInverse(T), T), pose([0, 0, 0, 1], [0, 0, 0]));
});

test("a camera has its target straight ahead, and the horizon is level", () => {
  const T = lookAt([3, -2, 1.5], [0.5, 1, 0.8]);
  const [x, y, z] = point(vectors.rigidInverse(T), [0.5, 1, 0.8]);
  near([x, y], [0, 0]);
  near([z], [-norm([2.5, -3, 0.7])]);
  near([T[2]], [0]);
  assert.ok(T[6] > 0, "up in the picture is up in the world");
});

test("a camera that looks straight down still has a picture that is square", () => {
  const T = lookAt([0, 0, 5], [0, 0, 0]);
  near(point(vectors.rigidInverse(T), [0, 0, 0]), [0, 0, -5]);
  near([norm(T.subarray(0, 3)), norm(T.subarray(4, 7)), norm(T.subarray(8, 11))], [1, 1, 1]);
});

test("a perspective ends at its angle, at its nearest and at its farthest", () => {
  const P = perspective(Math.PI / 2, 2, 0.5, 100);
  near(seen(P, [0, 3, -3]), [0, 1, seen(P, [0, 0, -3])[2]]);
  near([seen(P, [6, 0, -3])[0]], [1]);
  near([seen(P, [0, 0, -0.5])[2], seen(P, [0, 0, -100])[2]], [-1, 1], 1e-4);
});

test("a box that is seen along -z ends at its sides", () => {
  const P = vectors.parallel(2, 8);
  near(seen(P, [2, -2, 0]), [1, -1, 0]);
  near([seen(P, [0, 0, -8])[2], seen(P, [0, 0, 8])[2]], [1, -1]);
});

test("a frame that faces a direction is right-handed, whatever the direction", () => {
  for (const z of [
    [0, 0, 1],
    [0, 0, -2],
    [1, 0, 0],
    [-0.3, 0.9, 0.1],
  ]) {
    const T = facing(z, [1, 2, 3], 1, 1);
    const axes = [0, 4, 8].map((at) => Array.from(T.subarray(at, at + 3)));
    near(axes[2], vectors.unit(z));
    near(cross(axes[0], axes[1]), axes[2]);
    near(point(T, [0, 0, 0]), [1, 2, 3]);
  }
});

test("half way between two rotations is half of the turn", () => {
  const both = [0, 0, 0, 1, ...QUARTER_ABOUT_Z];
  const eighth = [0, 0, Math.sin(Math.PI / 8), Math.cos(Math.PI / 8)];
  near(vectors.between(both, 0, 4, 0.5), eighth);
  near(vectors.between(both, 0, 4, 0), [0, 0, 0, 1]);
  near(vectors.between(both, 0, 4, 1), QUARTER_ABOUT_Z);
});

test("rotations that are stored as whole numbers come out of unit length", () => {
  const stored = Int16Array.of(0, 0, 0, 32767, 0, 0, 23170, 23170);
  for (const mix of [0, 0.3, 1]) near([Math.hypot(...vectors.between(stored, 0, 4, mix))], [1]);
  near(vectors.between(new Float32Array(8), 0, 4, 0.5), [0, 0, 0, 0]);
});

test("places are mixed evenly", () => {
  near(vectors.mixed([0, 0, 0, 4, -8, 2], 0, 3, 0.25), [1, -2, 0.5]);
});
