import assert from "node:assert/strict";
import test from "node:test";

import { Character } from "../../capture_app/replay/viewer/character.js";
import { near } from "./near.js";

/** A triangle on one joint that goes 2 m up (y) in a second, below a node of half size. */
const SCENE = {
  nodes: [
    { scale: [0.5, 0.5, 0.5], children: [1] },
    { name: "hips" },
    { mesh: 0, skin: 0 },
    { mesh: 0, extras: { contacts: [] } },
  ],
  skins: [{ joints: [1] }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0, JOINTS_0: 1, WEIGHTS_0: 2 }, material: 0 }] }],
  materials: [{ pbrMetallicRoughness: { baseColorFactor: [1, 0, 0, 1] }, alphaMode: "MASK", alphaCutoff: 0.3 }],
  animations: [{
    channels: [{ sampler: 0, target: { node: 1, path: "translation" } }],
    samplers: [{ input: 3, output: 4 }],
  }],
  accessors: [
    { bufferView: 0, componentType: 5126, count: 3, type: "VEC3" },
    { bufferView: 0, byteOffset: 12, componentType: 5121, count: 3, type: "VEC4" },
    { bufferView: 0, byteOffset: 16, componentType: 5121, count: 3, type: "VEC4", normalized: true },
    { bufferView: 1, componentType: 5126, count: 2, type: "SCALAR" },
    { bufferView: 1, byteOffset: 8, componentType: 5126, count: 2, type: "VEC3" },
  ],
  bufferViews: [{ byteLength: 60, byteStride: 20 }, { byteOffset: 60, byteLength: 32 }],
};

/** A GLB whose surface lies vertex by vertex: place, joints, weights. @param {object} scene */
function glb(scene) {
  const text = JSON.stringify(scene);
  const json = new TextEncoder().encode(text + " ".repeat((4 - (text.length % 4)) % 4));
  const whole = new Uint8Array(28 + json.length + 92);
  const view = new DataView(whole.buffer);
  view.setUint32(12, json.length, true);
  whole.set(json, 20);
  const first = 28 + json.length;
  [[0, 0, 0], [1, 0, 0], [0, 1, 0]].forEach((place, v) => {
    place.forEach((value, k) => view.setFloat32(first + 20 * v + 4 * k, value, true));
    whole[first + 20 * v + 16] = 255;
  });
  [0, 1, 0, 0, 0, 0, 2, 0].forEach((value, k) => view.setFloat32(first + 60 + 4 * k, value, true));
  return whole.buffer;
}

test("a character's bones go where its animation says, in a world of z up", () => {
  const character = new Character(glb(SCENE));
  character.at(0.5);
  near(character.skins[0].rows, [0.5, 0, 0, 0, 0, 0, -0.5, 0, 0, 0.5, 0, 0.5]);
  character.at(9);
  assert.equal(character.skins[0].rows[11], 1);
});

test("its surface is read out of interleaved numbers, and the object is not of it", () => {
  const [part, ...more] = new Character(glb(SCENE)).parts;
  assert.equal(more.length, 0);
  const [places, normals, joints, weights] = part.columns.map(({ data }) => [...data]);
  assert.deepEqual(places, [0, 0, 0, 1, 0, 0, 0, 1, 0]);
  assert.deepEqual(normals, [0, 0, 1, 0, 0, 1, 0, 0, 1]);
  assert.deepEqual(joints, Array(12).fill(0));
  assert.deepEqual(weights, [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
  assert.deepEqual([part.color, part.cutoff], [[1, 0, 0], 0.3]);
});

test("whole numbers keep their size unless they are parts of one", () => {
  const [place, ...others] = SCENE.accessors;
  // The bytes of the number 1 are 0, 0, -128, 63.
  const bytes = (/** @type {object} */ more) => ({
    ...SCENE, accessors: [{ ...place, componentType: 5120, ...more }, ...others],
  });
  const places = (/** @type {object} */ scene) => [...new Character(glb(scene)).parts[0].columns[0].data];
  assert.deepEqual(places(bytes({})).slice(3, 6), [0, 0, -128]);
  assert.deepEqual(places(bytes({ normalized: true })).slice(3, 6), [0, 0, -1]);
});

test("what cannot be shown is refused in a sentence", () => {
  const stiff = { ...SCENE, nodes: [{ mesh: 0 }] };
  assert.throws(() => new Character(glb({ ...stiff, animations: [] })), /no surface that its bones move/);
  const packed = { ...SCENE, extensionsRequired: ["KHR_draco_mesh_compression"] };
  assert.throws(() => new Character(glb(packed)), /packed/);
});
