import assert from "node:assert/strict";
import test from "node:test";

import { readPack, withPeople } from "../../capture_app/replay/viewer/pack.js";
import { HEADER, packed } from "./made_pack.js";

const ARRAYS = {
  valid: { dtype: "u1", shape: [3], values: [1, 0, 1] },
  root: { dtype: "f4", shape: [1, 3, 3], values: [0, 1, 2, 3, 4, 5, 6, 7, 8.5] },
  rotations: { dtype: "i2", shape: [1, 1, 1, 4], values: [0, -32767, 5, 32767] },
  object_normals: { dtype: "i1", shape: [1, 3], values: [-127, 0, 127] },
  object_faces: { dtype: "u2", shape: [1, 3], values: [0, 1, 65535] },
  film_offsets: { dtype: "u4", shape: [2], values: [0, 4000000000] },
};

test("all arrays come back as they were, whatever their types", () => {
  const pack = readPack(packed(HEADER, ARRAYS));
  for (const [name, { values }] of Object.entries(ARRAYS)) {
    assert.deepEqual(Array.from(pack.array(name)), values, name);
  }
});

test("the arrays are found behind a header of any length", () => {
  for (let extra = 0; extra < 9; extra += 1) {
    const pack = readPack(packed({ ...HEADER, name: "é".repeat(extra) }, ARRAYS));
    assert.equal(pack.header.name, "é".repeat(extra));
    assert.deepEqual(Array.from(pack.need("root")), ARRAYS.root.values);
  }
});

test("an array is a view of the pack's own bytes, made once", () => {
  const buffer = packed(HEADER, ARRAYS);
  const pack = readPack(buffer);
  assert.equal(pack.array("root").buffer, buffer);
  assert.equal(pack.array("root"), pack.array("root"));
});

test("what a pack does not hold is null, and refused by name where it is needed", () => {
  const pack = readPack(packed(HEADER, {}));
  assert.equal(pack.array("phone_position"), null);
  assert.throws(() => pack.need("phone_position"), /no phone_position/);
});

test("an array without an element is there", () => {
  const pack = readPack(packed(HEADER, { film_times: { dtype: "f4", shape: [0], values: [] } }));
  assert.equal(pack.array("film_times").length, 0);
});

test("a correction takes the place of the people alone", () => {
  const whole = readPack(packed({ ...HEADER, contacts: [[]], name: "whole" }, ARRAYS));
  const root = { dtype: "f4", shape: [1, 3, 3], values: Array(9).fill(4) };
  const segment = { hand: "left", start: 0, stop: 2, anchor: [0, 0, 1] };
  const told = { ...HEADER, kind: "people", contacts: [[segment]], faults: [[]], grips: [[]], unsolved: [] };
  const pack = withPeople(whole, packed(told, { root }));
  assert.deepEqual(Array.from(pack.need("root")), root.values);
  assert.deepEqual(Array.from(pack.array("valid")), ARRAYS.valid.values);
  assert.deepEqual([pack.header.name, pack.header.kind], ["whole", "result"]);
  assert.deepEqual(pack.header.contacts, [[segment]]);
  assert.deepEqual(whole.header.contacts, [[]]);
});

test("another version is refused", () => {
  assert.throws(() => readPack(packed({ ...HEADER, version: 1 }, {})), /version 1/);
});
