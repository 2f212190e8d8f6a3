// Reads a scene pack: a JSON header and plain arrays (capture_app/replay/scene_pack.py).

/** What docs/replay.md lists of a header.
 *  @typedef {{
 *    version: number, kind: "result" | "people" | "film" | "session" | "object", name: string,
 *    fps: number, frames: number, samples: number, chosen: number, first: number, editable: boolean,
 *    joint_names: string[], joint_parents: number[], contacts: Segment[][], unsolved: number[],
 *    object: {name: string} | null, body: {height: number} | null, report: {verdict: string, app: string} | null,
 *    events: Check[], faults: Check[][], grips: Grip[][], notes: string[], phone: Lens | null, filmed: number[],
 *    arrays: Record<string, {dtype: keyof typeof TYPES, shape: number[], offset: number}>,
 *  }} Header */
/** When a hand holds the object, frames `start` to `stop` (exclusive), and where.
 *  @typedef {{hand: string, start: number, stop: number} & Partial<Held>} Segment */
/** `anchor` of the palm; `place` and `normal` on the surface beside it; all in the object's frame.
 *  @typedef {{anchor: number[] | null, place: number[], normal: number[]}} Held */
/** A check of the report that is not fine; `start` and `stop` in frames, null for the whole take.
 *  @typedef {{name: string, severity: "bad" | "warn", message: string, fix: string,
 *    start: number | null, stop: number | null}} Check */
/** How a hand holds, in frames. @typedef {{message: string, start: number, stop: number}} Grip */
/** Angle of the phone's picture, and quarter turns that bring it upright.
 *  @typedef {{fov_y: number, aspect: number, turns: number}} Lens */
/** @typedef {"body" | "object"} Surface */
/** @typedef {"object" | "phone"} Moving */
/** @typedef {Float32Array<ArrayBuffer>} Floats */
/** @typedef {Uint8Array<ArrayBuffer>} Bytes */
/** @typedef {Uint16Array<ArrayBuffer> | Uint32Array<ArrayBuffer>} Faces */
/** @typedef {Record<`${Surface}_vertices` | `${Moving}_position` | `${Moving}_rotation` | "rest_joints"
 *    | "object_uv" | "root" | "palm_miss" | "inside" | "phone_speed" | "film_times", Floats>
 *  & Record<`${Surface}_normals`, Int8Array<ArrayBuffer>> & Record<`${Surface}_faces`, Faces>
 *  & Record<"skin_joints" | "skin_weights" | "hand_contact" | "foot_contact" | "valid" | "tracking"
 *    | "film_jpeg" | "object_png" | "object_jpg", Bytes>
 *  & {rotations: Int16Array<ArrayBuffer>, film_offsets: Uint32Array<ArrayBuffer>}} Arrays */
/** @typedef {Arrays[keyof Arrays]} Numbers */
/** `array` is null where the pack has none of this name, and `need` refuses it.
 *  @typedef {{
 *    header: Header,
 *    array: <K extends keyof Arrays>(name: K) => Arrays[K] | null,
 *    need: <K extends keyof Arrays>(name: K) => Arrays[K],
 *  }} Pack */

const TYPES = {
  f4: Float32Array,
  i2: Int16Array,
  i1: Int8Array,
  u1: Uint8Array,
  u2: Uint16Array,
  u4: Uint32Array,
};

/** A pack with other people in it, as a correction moves them. @param {Pack} pack @param {ArrayBuffer} buffer
 *  @returns {Pack} */
export function withPeople(pack, buffer) {
  const { header, array: own } = readPack(buffer);
  const { contacts, unsolved, faults, grips } = header;
  /** @type {Pack["array"]} */
  const array = (name) => own(name) ?? pack.array(name);
  /** @type {Pack["need"]} */
  const need = (name) => own(name) ?? pack.need(name);
  return { header: { ...pack.header, contacts, unsolved, faults, grips }, array, need };
}

/** @param {ArrayBuffer} buffer @returns {Pack} */
export function readPack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  /** @type {Header} */
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if (header.version !== 2) throw new Error(`scene packs of version ${header.version} are not read`);
  const first = Math.ceil((4 + length) / 8) * 8;
  const views = new Map();
  /** @type {Pack["array"]} */
  const array = (name) => {
    const told = header.arrays[name];
    if (!told) return null;
    if (!views.has(name)) {
      const count = told.shape.reduce((a, b) => a * b, 1);
      views.set(name, new TYPES[told.dtype](buffer, first + told.offset, count));
    }
    return views.get(name);
  };
  /** @type {Pack["need"]} */
  const need = (name) => {
    const found = array(name);
    if (!found) throw new Error(`the scene pack has no ${name}`);
    return found;
  };
  return { header, array, need };
}
