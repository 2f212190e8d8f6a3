// Where everything of a scene is at a moment, between its frames.

import { between, mixed, point, pose } from "./vectors.js";
/** @import {Moving, Pack} from "./pack.js" */

const BROKEN = 2;
// Frames: a pause that does not end a hold, and the time of one within which its middle is looked for.
const PAUSE = 40;
const LONGEST = 300;
const PALMS = ["left_middle1", "right_middle1"];

/** The frames before and after a moment, the one that is nearest, and the share of the later.
 *  @typedef {{frame: number, low: number, high: number, mix: number}} Step */
/** @typedef {ReturnType<Motion["at"]>} Moment */

export class Motion {
  /** @param {Pack} pack */
  constructor(pack) {
    this.pack = pack;
    this.header = pack.header;
    this.sample = pack.header.first;
    this.frames = pack.header.frames;
    this.duration = Math.max(0, this.frames - 1) / pack.header.fps;
    this.palmJoints = PALMS.map((name) => pack.header.joint_names.indexOf(name));
    this.joints = new Float32Array(52 * 3);
    this.bones = new Float32Array(52 * 12);
  }

  /** The pose at a second; what it returns holds until the next call. @param {number} time */
  at(time) {
    const exact = Math.min(Math.max(time, 0), this.duration) * this.header.fps;
    const frame = Math.min(Math.round(exact), this.frames - 1);
    const low = Math.min(Math.floor(exact + 1e-6), this.frames - 1);
    const high = Math.min(low + 1, this.frames - 1);
    const step = { frame, low, high, mix: Math.max(0, exact - low) };
    const has = this.pack.array("root") !== null;
    const valid = this.pack.array("valid");
    if (has) this.#bend(step);
    return {
      frame,
      bones: has ? this.bones : null,
      joints: has ? this.joints : null,
      object: this.#rigid("object", step, this.#split("valid", 0, step)),
      phone: this.#rigid("phone", step, this.#split("tracking", BROKEN, step)),
      valid: !valid || valid[frame] > 0,
      palms: has ? this.palmJoints.map((j) => Array.from(this.joints.subarray(3 * j, 3 * j + 3))) : [],
      held: has ? Array.from(this.#held(frame), (share) => share / 255) : [],
    };
  }

  /** Mean place of the person, else the object, else the phone, around a moment.
   *  @param {number} time @param {number} halfWidth @returns {number[]} */
  centre(time, halfWidth) {
    const way = this.way();
    const fps = this.header.fps;
    const first = Math.max(0, Math.ceil((time - halfWidth) * fps));
    const last = Math.min(this.frames - 1, Math.floor((time + halfWidth) * fps));
    const sum = [0, 0, 0];
    for (let f = first; f <= last; f++) for (let k = 0; k < 3; k++) sum[k] += way[3 * f + k];
    const count = Math.max(1, last - first + 1);
    return last < first ? Array.from(way.subarray(3 * (this.frames - 1))) : sum.map((s) => s / count);
  }

  way() {
    const root = this.pack.array("root");
    const size = 3 * this.frames;
    if (root) return root.subarray(this.sample * size, (this.sample + 1) * size);
    return this.pack.array("object_position") ?? this.pack.need("phone_position");
  }

  contacts() {
    return this.header.contacts[this.sample] ?? [];
  }

  /** The moment amid the first time in which a hand holds, seconds; a short pause does not end that time,
   *  and of a long one the first seconds count, as in `middle_of_hold` of omomo_core. */
  heldAt() {
    const held = [...this.contacts()].sort((a, b) => a.start - b.start);
    const start = held[0]?.start ?? 0;
    let stop = held[0]?.stop ?? 0;
    for (const one of held) if (one.start <= stop + PAUSE) stop = Math.max(stop, one.stop);
    return Math.floor(start + Math.min(stop - start, LONGEST) / 2) / this.header.fps;
  }

  /** One value a frame of this sample, out of an array (samples, frames, width).
   *  @param {"palm_miss" | "inside"} name @param {number} width @param {number} column */
  series(name, width = 1, column = 0) {
    const array = this.pack.array(name);
    if (!array) return null;
    const start = array.length === this.frames * width ? 0 : this.sample * this.frames * width;
    return Float32Array.from({ length: this.frames }, (_, f) => array[start + f * width + column]);
  }

  /** Of each hand. @param {number} frame */
  #held(frame) {
    const first = (this.sample * this.frames + frame) * 2;
    return this.pack.need("hand_contact").subarray(first, first + 2);
  }

  /** A tracker's pose means nothing between two frames of which one is a guess.
   *  @param {"valid" | "tracking"} name @param {number} bad @param {Step} step */
  #split(name, bad, { low, high }) {
    const marks = this.pack.array(name);
    return marks !== null && (marks[low] === bad || marks[high] === bad);
  }

  /** @param {Moving} name @param {Step} step @param {boolean} split */
  #rigid(name, { low, high, mix }, split) {
    const positions = this.pack.array(`${name}_position`);
    if (!positions) return null;
    const share = split ? Math.round(mix) : mix;
    const turned = between(this.pack.need(`${name}_rotation`), 4 * low, 4 * high, share);
    return pose(turned, mixed(positions, 3 * low, 3 * high, share));
  }

  /** @param {Step} step */
  #bend({ low, high, mix }) {
    const [rest, root] = [this.pack.need("rest_joints"), this.pack.need("root")];
    const rotations = this.pack.need("rotations");
    const first = this.sample * this.frames;
    const parents = this.header.joint_parents;
    /** @type {Float32Array[]} */
    const T = [];
    for (let j = 0; j < parents.length; j++) {
      /** @param {number} f */
      const at = (f) => 4 * ((first + f) * parents.length + j);
      const q = between(rotations, at(low), at(high), mix);
      const place =
        j === 0
          ? mixed(root, 3 * (first + low), 3 * (first + high), mix)
          : point(T[parents[j]], this.#bone(rest, j, parents[j]));
      T.push(pose(q, place));
      this.joints.set(place, 3 * j);
      this.#setBone(j, T[j], rest);
    }
  }

  /** @param {Float32Array} rest @param {number} j @param {number} parent */
  #bone(rest, j, parent) {
    return [0, 1, 2].map((k) => rest[3 * j + k] - rest[3 * parent + k]);
  }

  /** Three rows: the rotation, and what brings a vertex at rest to its place.
   *  @param {number} j @param {Float32Array} T @param {Float32Array} rest */
  #setBone(j, T, rest) {
    for (let row = 0; row < 3; row++) {
      const r = [T[row], T[4 + row], T[8 + row]];
      const turned = r[0] * rest[3 * j] + r[1] * rest[3 * j + 1] + r[2] * rest[3 * j + 2];
      this.bones.set([...r, T[12 + row] - turned], 12 * j + 4 * row);
    }
  }
}
