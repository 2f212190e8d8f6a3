import assert from "node:assert/strict";
import test from "node:test";

import { middle } from "../../capture_app/replay/viewer/actor.js";
import { blend } from "../../capture_app/replay/viewer/palette.js";
import { ball, frustum, phone } from "../../capture_app/replay/viewer/shapes.js";
import { cross, dot, norm, sub } from "../../capture_app/replay/viewer/vectors.js";
import { near } from "./near.js";

const corner = (array, k) => Array.from(array.subarray(3 * k, 3 * k + 3));

/** Six times the volume that the faces enclose; negative where they are turned inside out. */
function sixVolumes({ vertices, faces }) {
  let sum = 0;
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => corner(vertices, faces[f + k]));
    sum += dot(a, cross(b, c));
  }
  return sum;
}

test("a ball is round, closed, and its faces look outwards", () => {
  const made = ball(40, 72);
  for (let k = 0; k < made.vertices.length / 3; k += 1)
    near([norm(corner(made.vertices, k))], [1], 1e-5);
  near([sixVolumes(made) / 6], [(4 / 3) * Math.PI], 0.03);
});

test("the phone is a box of its size whose faces look as their normals do", () => {
  const made = phone();
  near([sixVolumes(made) / 6], [0.147 * 0.071 * 0.008], 1e-8);
  for (let f = 0; f < made.faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => corner(made.vertices, made.faces[f + k]));
    assert.ok(dot(cross(sub(b, a), sub(c, a)), corner(made.normals, made.faces[f])) > 0);
  }
});

test("a picture's corners are where its angle ends", () => {
  const lines = frustum({ fov_y: Math.PI / 2, aspect: 1.5 }, 2);
  assert.equal(lines.length, 8);
  const [from, to] = lines[0];
  near(from, [0, 0, 0]);
  near(to, [-3, -2, -2]);
  for (const [a, b] of lines) near([a[2] === 0 ? -2 : a[2], b[2]], [-2, -2]);
});

test("the middle of a mesh is that of its box", () => {
  near(middle([0, 0, 0, 4, 0, 0, 1, 2, -6]), [2, 1, -3]);
});

test("colours are mixed by their shares", () => {
  near(blend([0, 1, 0.5], [1, 0, 0.5], 0.25), [0.25, 0.75, 0.5]);
});
