// A character that moves by itself, read from a GLB with a skin and an animation, as our export writes it.

import { Mesh } from "./gpu.js";
import { Picture } from "./picture.js";
import { between, cross, frame, mixed, multiply, placed, pose, sub } from "./vectors.js";
/** @import {Column} from "./gpu.js" @import {Bytes, Faces, Floats, Numbers} from "./pack.js"
 *  @import {Solid} from "./stage.js" */

/** @typedef {WebGL2RenderingContext} Gl */
/** A piece of a surface: bent by a skin, or moved with its node as a whole.
 *  @typedef {{node: number, skin: number | undefined, columns: Column[], faces: Faces, color: number[],
 *    image: Blob | null, cutoff: number}} Part */
/** The key frames of a node. @typedef {{times: Floats, values: Floats}} Track */
/** @typedef {{joints: number[], inverse: Floats, rows: Float32Array}} Skin */

/** Sizes and readers of a number, by glTF's codes of its kind. */
const KINDS = /** @type {const} */ ({
  5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array,
});
/** @type {Record<number, number>} */
const LARGEST = { 5120: 127, 5121: 255, 5122: 32767, 5123: 65535 };
/** @type {Record<string, number>} */
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };
const TRIANGLES = 4;
const PACKED = ["KHR_draco_mesh_compression", "EXT_meshopt_compression"];
const GREY = 0.72;
/** Of glTF's y up in a world of z up. */
const UPRIGHT = frame([1, 0, 0], [0, 0, 1], [0, -1, 0], [0, 0, 0]);

export class Character {
  /** What cannot be shown is refused in a sentence. @param {ArrayBuffer} buffer a GLB with an animation */
  constructor(buffer) {
    const glb = new Glb(buffer);
    const packed = PACKED.find((name) => glb.json.extensionsRequired?.includes(name));
    if (packed) throw new Error(`The character's surface is packed (${packed}), which this view does not read.`);
    /** @type {any[]} */
    this.nodes = glb.json.nodes ?? [];
    this.order = ordered(this.nodes);
    this.tracks = glb.tracks();
    /** @type {Skin[]} */
    this.skins = glb.skins();
    this.parts = this.nodes.flatMap((_, node) => glb.parts(node));
    if (!this.parts.some(({ skin }) => skin !== undefined)) {
      throw new Error("The character has no surface that its bones move, so this view cannot show it.");
    }
    /** Where nodes are now, in our world. @type {Float32Array[]} */
    this.places = [];
    /** @type {{part: Part, mesh: Mesh, picture: Picture | null}[]} */
    this.surfaces = [];
  }

  /** Puts it on the card. @param {Gl} gl @param {() => void} changed when more of it can be drawn */
  upload(gl, changed) {
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const bones = Math.max(...this.skins.map(({ joints }) => joints.length));
    if (bones > most) throw new Error(`The character has ${bones} bones; this graphics card takes ${most}.`);
    this.surfaces = this.parts.map((part) => ({
      part,
      mesh: new Mesh(gl, part.columns, part.faces),
      picture: part.image && new Picture(gl, part.image, changed),
    }));
  }

  dispose() {
    for (const { mesh, picture } of this.surfaces) {
      mesh.dispose();
      picture?.dispose();
    }
    this.surfaces = [];
  }

  /** What to draw at a second; it holds until the next call.
   *  @param {number} time @returns {Omit<Solid, "sheen">[]} */
  at(time) {
    for (const [node, parent] of this.order) {
      const above = parent < 0 ? UPRIGHT : this.places[parent];
      this.places[node] = multiply(above, this.#local(node, time));
    }
    this.skins.forEach((skin) => this.#bend(skin));
    return this.surfaces.map(({ part, mesh, picture }) => {
      const { node, skin, color, cutoff } = part;
      const where = skin === undefined ? { place: this.places[node] } : { bones: this.skins[skin].rows };
      return { mesh, color, picture, cutoff, ...where };
    });
  }

  /** @param {number} node @param {number} time */
  #local(node, time) {
    const { matrix, translation = [0, 0, 0], rotation = [0, 0, 0, 1], scale = [1, 1, 1] } = this.nodes[node];
    if (matrix) return Float32Array.from(matrix);
    const [way, turn] = ["translation", "rotation"].map((path) => this.tracks.get(`${node} ${path}`));
    const q = turn ? keyed(turn, time, 4, between) : rotation;
    const T = pose(q, way ? keyed(way, time, 3, mixed) : translation);
    for (let k = 0; k < 12; k++) T[k] *= scale[k >> 2] ?? 1;
    return T;
  }

  /** @param {Skin} skin */
  #bend({ joints, inverse, rows }) {
    for (const [j, node] of joints.entries()) {
      const T = multiply(this.places[node], inverse.subarray(16 * j, 16 * j + 16));
      for (let row = 0; row < 3; row++) {
        for (let k = 0; k < 4; k++) rows[12 * j + 4 * row + k] = T[4 * k + row];
      }
    }
  }
}

/** A value between the key frames around a second.
 *  @param {Track} track @param {number} time @param {number} width @param {typeof mixed} mix */
function keyed({ times, values }, time, width, mix) {
  let [low, high] = [0, times.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  const share = high > low ? (time - times[low]) / (times[high] - times[low]) : 0;
  return mix(values, width * low, width * high, Math.min(Math.max(share, 0), 1));
}

/** Nodes with what they hang on, parents first. @param {any[]} nodes */
function ordered(nodes) {
  const parents = nodes.map(() => -1);
  nodes.forEach(({ children = [] }, node) => children.forEach((/** @type {number} */ c) => (parents[c] = node)));
  const order = parents.flatMap((parent, node) => (parent < 0 ? [node] : []));
  for (const node of order) order.push(...(nodes[node].children ?? []));
  return order.map((node) => [node, parents[node]]);
}

/** The JSON of a GLB, and its numbers. */
class Glb {
  /** @param {ArrayBuffer} buffer */
  constructor(buffer) {
    const view = new DataView(buffer);
    const length = view.getUint32(12, true);
    this.json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
    this.buffer = buffer;
    this.first = 28 + length;
  }

  /** Key frames of the first animation, by node and path. */
  tracks() {
    const { samplers = [], channels = [] } = this.json.animations?.[0] ?? {};
    /** @type {Map<string, Track>} */
    const tracks = new Map();
    for (const { sampler, target } of channels) {
      const { input, output } = samplers[sampler];
      tracks.set(`${target.node} ${target.path}`, { times: this.floats(input), values: this.floats(output) });
    }
    return tracks;
  }

  skins() {
    /** @param {{joints: number[], inverseBindMatrices?: number}} skin @returns {Skin} */
    const read = ({ joints, inverseBindMatrices: of }) => {
      const still = () => Float32Array.from(joints.flatMap(() => [...placed([0, 0, 0])]));
      const inverse = of === undefined ? still() : this.floats(of);
      return { joints, inverse, rows: new Float32Array(12 * joints.length) };
    };
    return (this.json.skins ?? []).map(read);
  }

  /** The surfaces of a node; not of the object, which the scene has already.
   *  @param {number} number @returns {Part[]} */
  parts(number) {
    const { mesh, skin, extras } = this.json.nodes[number];
    if (mesh === undefined || extras?.contacts) return [];
    return this.json.meshes[mesh].primitives
      .filter((/** @type {any} */ { mode = TRIANGLES }) => mode === TRIANGLES)
      .map((/** @type {any} */ one) => this.#part(number, skin, one));
  }

  /** @param {number} node @param {number | undefined} skin @param {any} primitive @returns {Part} */
  #part(node, skin, { attributes, indices, material }) {
    const vertices = this.floats(attributes.POSITION);
    const faces = this.#faces(indices, vertices.length / 3);
    const normals = attributes.NORMAL === undefined ? normalsOf(vertices, faces) : this.floats(attributes.NORMAL);
    const uv = attributes.TEXCOORD_0;
    const spots = uv === undefined ? new Float32Array((2 * vertices.length) / 3) : this.floats(uv);
    /** @type {Column[]} */
    const columns = [{ data: vertices, width: 3 }, { data: normals, width: 3 }];
    if (skin !== undefined) {
      columns.push({ data: this.numbers(attributes.JOINTS_0), width: 4 });
      columns.push({ data: this.floats(attributes.WEIGHTS_0), width: 4 });
    }
    columns.push({ data: spots, width: 2 });
    const look = this.#look(this.json.materials?.[material]);
    return { node, skin, columns, faces, ...look, image: uv === undefined ? null : look.image };
  }

  /** @param {number | undefined} indices @param {number} count @returns {Faces} */
  #faces(indices, count) {
    if (indices === undefined) return Uint32Array.from({ length: count }, (_, k) => k);
    const found = this.numbers(indices);
    return found instanceof Uint32Array ? found : Uint16Array.from(found);
  }

  /** Its base colour, as a screen shows it, and its picture. @param {any} material */
  #look(material) {
    const { baseColorFactor: factor, baseColorTexture: texture } = material?.pbrMetallicRoughness ?? {};
    const color = (factor ?? [GREY, GREY, GREY]).slice(0, 3).map((/** @type {number} */ c) => c ** (1 / 2.2));
    const { alphaMode = "OPAQUE", alphaCutoff = 0.5 } = material ?? {};
    const cutoff = alphaMode === "OPAQUE" ? 0 : alphaCutoff;
    return { color, cutoff, image: texture ? this.#image(texture) : null };
  }

  /** @param {{index: number, texCoord?: number}} texture */
  #image({ index, texCoord = 0 }) {
    const { source, extensions } = this.json.textures[index];
    const image = this.json.images?.[source ?? extensions?.EXT_texture_webp?.source];
    if (image?.bufferView === undefined || texCoord) return null;
    const { byteOffset = 0, byteLength } = this.json.bufferViews[image.bufferView];
    const bytes = new Uint8Array(this.buffer, this.first + byteOffset, byteLength);
    return new Blob([bytes], { type: image.mimeType });
  }

  /** Numbers of an accessor as floats; whole numbers that stand for parts of 1 become these.
   *  @param {number} number @returns {Floats} */
  floats(number) {
    const { componentType, normalized } = this.json.accessors[number];
    const found = this.numbers(number);
    if (found instanceof Float32Array) return found;
    if (!normalized) return Float32Array.from(found);
    return Float32Array.from(found, (value) => Math.max(value / LARGEST[componentType], -1));
  }

  /** Numbers of an accessor, without gaps. @param {number} number @returns {Numbers} */
  numbers(number) {
    const { bufferView, byteOffset = 0, componentType, count, type, sparse } = this.json.accessors[number];
    const Kind = KINDS[/** @type {keyof typeof KINDS} */ (componentType)];
    const width = WIDTHS[type];
    if (sparse || bufferView === undefined || !Kind || !width) {
      throw new Error("The character's file stores its surface in a way that this view does not read.");
    }
    const view = this.json.bufferViews[bufferView];
    const [size, start] = [width * Kind.BYTES_PER_ELEMENT, this.first + (view.byteOffset ?? 0) + byteOffset];
    const stride = view.byteStride ?? size;
    /** @type {Bytes} */
    const tight = new Uint8Array(count * size);
    if (stride === size) tight.set(new Uint8Array(this.buffer, start, count * size));
    else for (let k = 0; k < count; k++) tight.set(new Uint8Array(this.buffer, start + k * stride, size), k * size);
    return new Kind(tight.buffer);
  }
}

/** Of each vertex, from its faces. @param {Floats} vertices @param {Faces} faces */
function normalsOf(vertices, faces) {
  const normals = new Float32Array(vertices.length);
  /** @param {number} v */
  const at = (v) => vertices.subarray(3 * v, 3 * v + 3);
  for (let f = 0; f + 2 < faces.length; f += 3) {
    const [a, b, c] = faces.subarray(f, f + 3);
    const normal = cross(sub(at(b), at(a)), sub(at(c), at(a)));
    for (const v of [a, b, c]) normal.forEach((value, k) => (normals[3 * v + k] += value));
  }
  return normals;
}
