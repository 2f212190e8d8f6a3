// Where the scene is seen from: around a place that stays or goes along, through the phone, from above.

import {
  add,
  cross,
  direction,
  frame,
  lookAt,
  multiply,
  perspective,
  point,
  scaled,
} from "./vectors.js";
import { middle, reachOf } from "./actor.js";
/** @import {Moment, Motion} from "./motion.js"
 *  @import {Pack} from "./pack.js" */

/** What is seen: from where, how wide, and around which place there is light and floor.
 *  @typedef {{T_world_camera: Float32Array, projection: Float32Array, focus: number[], spread: number,
 *    reach: number, sun: number}} View */
/** @typedef {"orbit" | "follow" | "front" | "side" | "hands" | "feet" | "phone" | "object" | "top"} Mode */

/** @type {Mode[]} */
export const MODES = ["orbit", "follow", "front", "side", "hands", "feet", "phone", "object", "top"];
/** The modes that look at the person from a side of theirs: radians from where they face, and up. */
const SIDES = { front: [0, 0.08], side: [Math.PI / 2, 0.08], hands: [0.6, 0.35], feet: [0.9, 0.2] };
/** Joints that the camera stays on. @type {Partial<Record<Mode, string[]>>} */
const JOINTS = { hands: ["left_middle1", "right_middle1"], feet: ["left_foot", "right_foot"] };
/** Modes in which the whole person is followed. @type {Mode[]} */
const FOLLOWING = ["follow", "front", "side"];
const FOV = 0.62;
const TOP_FOV = 0.3;
const STEEPEST = 1.5;
const SMOOTH = 0.6; // seconds around a moment over which who is followed is averaged
// A picture that is narrower than so many times its height is seen from farther away.
const NARROW = 0.9;
const NARROW_FOLLOWED = 0.45;
const PERSON = 1.75; // metres
const NEAREST = 0.25;
const FARTHEST = 60;

export class Camera {
  constructor() {
    /** @type {Mode} */
    this.mode = "orbit";
    this.yaw = 0.6;
    this.pitch = 0.28;
    this.pan = [0, 0, 0];
    this.zoom = 1;
    this.sun = 0;
    this.scene = { centre: [0, 0, 0.8], radius: 2, object: 0.4, person: PERSON };
  }

  /** Looks at the whole of some motions, from before the person. @param {Motion[]} motions */
  frame(motions) {
    const points = motions.flatMap((motion) => places(motion));
    const low = [0, 1, 2].map((k) => Math.min(...points.map((p) => p[k])));
    const high = [0, 1, 2].map((k) => Math.max(...points.map((p) => p[k])));
    const centre = low.map((value, k) => (value + high[k]) / 2);
    const radius = Math.max(0.25, Math.hypot(...high.map((value, k) => value - low[k])) / 2);
    const object = Math.max(0.15, ...motions.map((motion) => reachOf(motion.pack)));
    const person = Math.max(...motions.map(({ header }) => header.body?.height ?? PERSON));
    this.scene = { centre, radius, object, person };
    this.pan = [0, 0, 0];
    this.zoom = 1;
    this.yaw = facingOf(motions[0]) + 0.55;
    this.sun = this.yaw - 0.8;
    this.pitch = 0.28;
  }

  /** What is seen from a side is seen from that of the person at this second.
   *  @param {string} name @param {Motion | undefined} motion @param {number} time */
  set(name, motion, time) {
    const mode = MODES.find((known) => known === name);
    if (!mode) throw new Error(`there is no camera ${name}`);
    const side = Object.entries(SIDES).find(([known]) => known === mode);
    if (side && motion) {
      this.yaw = facingOf(motion, time) + side[1][0];
      this.pitch = side[1][1];
    }
    if (mode === this.mode) return;
    this.mode = mode;
    this.pan = [0, 0, 0];
    this.zoom = 1;
  }

  /** @param {number} dx @param {number} dy */
  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.max(this.pitch + dy, -0.15), STEEPEST);
  }

  /** By shares of the picture's height. @param {number} dx @param {number} dy */
  move(dx, dy) {
    const T = this.#around([0, 0, 0], 1);
    const size = 2 * this.#distance() * Math.tan(this.#fov() / 2);
    const right = scaled([T[0], T[1], T[2]], -dx * size);
    this.pan = add(this.pan, add(right, scaled([T[4], T[5], T[6]], dy * size)));
  }

  /** @param {number} factor */
  closer(factor) {
    const { zoom } = this;
    this.zoom = zoom * factor;
    const distance = this.#distance();
    if (distance < NEAREST || distance > FARTHEST) this.zoom = zoom;
  }

  /** For a motion at a second.
   *  @param {Motion} motion @param {number} time @param {number} aspect @returns {View} */
  view(motion, time, aspect) {
    const now = motion.at(time);
    const focus = this.#focus(motion, now, time);
    const spread = this.mode === "object" ? Math.max(2, 3 * this.scene.object) : 2.6;
    const narrow = FOLLOWING.includes(this.mode) ? NARROW_FOLLOWED : NARROW;
    const distance = this.#distance() * Math.max(1, narrow / aspect);
    const reach = Math.max(6, this.scene.radius + 5, 1.6 * distance);
    const shared = { focus, spread, reach, sun: this.sun };
    if (this.mode === "phone" && now.phone) {
      return { ...this.#through(motion, now.phone, aspect), ...shared };
    }
    return {
      ...shared,
      T_world_camera: this.#around(add(this.#target(motion, now, time), this.pan), distance),
      projection: perspective(this.#fov(), aspect, Math.max(0.02, distance / 100), distance + 80),
    };
  }

  #fov() {
    return this.mode === "top" ? TOP_FOV : FOV;
  }

  #distance() {
    const half = Math.tan(this.#fov() / 2);
    // A person fills half the height of the picture.
    const person = this.scene.person / 1.08;
    const size = {
      orbit: Math.min(this.scene.radius, 2.4),
      top: this.scene.radius + 0.4,
      follow: person,
      front: person,
      side: person,
      hands: 0.42,
      feet: 0.42,
      object: 1.5 * this.scene.object,
      phone: 1,
    }[this.mode];
    return (this.zoom * 1.08 * size) / half;
  }

  /** @param {Motion} motion @param {Moment} now @param {number} time */
  #target(motion, now, time) {
    if (this.mode === "object" && now.object) return centreOfObject(motion.pack, now.object);
    const joints = JOINTS[this.mode];
    if (joints && now.joints) return middle(joints.flatMap((name) => jointOf(motion, now, name)));
    if (FOLLOWING.includes(this.mode)) {
      const [x, y] = motion.centre(time, SMOOTH);
      return [x, y, 0.55 * this.scene.person];
    }
    return this.scene.centre;
  }

  /** Middle of what casts a shadow.
   *  @param {Motion} motion @param {Moment} now @param {number} time */
  #focus(motion, now, time) {
    if (now.object && !now.joints) return centreOfObject(motion.pack, now.object);
    const [x, y] = now.joints ?? motion.centre(time, 0);
    return [x, y, 0.8];
  }

  /** @param {number[]} target @param {number} distance */
  #around(target, distance) {
    const pitch = this.mode === "top" ? Math.PI / 2 - 1e-4 : this.pitch;
    const level = Math.cos(pitch);
    const away = [level * Math.cos(this.yaw), level * Math.sin(this.yaw), Math.sin(pitch)];
    return lookAt(add(target, scaled(away, distance)), target);
  }

  /** The phone's own picture, turned until up is at its top, as its film is.
   *  @param {Motion} motion @param {Float32Array} T_world_phone @param {number} aspect */
  #through(motion, T_world_phone, aspect) {
    const lens = motion.header.phone ?? { fov_y: 0.9, aspect: 4 / 3, turns: 0 };
    const angle = (-Math.PI / 2) * lens.turns;
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const turn = frame([c, s, 0], [-s, c, 0], [0, 0, 1], [0, 0, 0]);
    const tall = Math.tan(lens.fov_y / 2) * (lens.turns % 2 ? lens.aspect : 1);
    const wide = Math.tan(lens.fov_y / 2) * (lens.turns % 2 ? 1 : lens.aspect);
    const fov = 2 * Math.atan(Math.max(tall, wide / aspect));
    return {
      T_world_camera: multiply(T_world_phone, turn),
      projection: perspective(fov, aspect, 0.01, 100),
    };
  }
}

/** A ray through a point of the picture: x to the right, y up, from -1 to 1.
 *  @param {View} view @param {number} x @param {number} y */
export function ray(view, x, y) {
  const T = view.T_world_camera;
  const toward = [x / view.projection[0], y / view.projection[5], -1];
  return { origin: [T[12], T[13], T[14]], toward: direction(T, toward) };
}

/** @type {WeakMap<Pack, number[]>} */
const middles = new WeakMap();

/** @param {Pack} pack @param {Float32Array} T */
export function centreOfObject(pack, T) {
  const known = middles.get(pack);
  if (known) return point(T, known);
  const found = middle(pack.array("object_vertices") ?? [0, 0, 0]);
  middles.set(pack, found);
  return point(T, found);
}

/** Points that the whole of a motion lies between. @param {Motion} motion */
function places(motion) {
  const { pack, frames } = motion;
  const reach = reachOf(pack);
  const way = motion.way();
  const step = Math.max(1, Math.floor(frames / 300));
  const found = [];
  for (let f = 0; f < frames; f += step) {
    const p = Array.from(way.subarray(3 * f, 3 * f + 3));
    if (pack.array("root")) found.push([p[0] - 0.4, p[1] - 0.4, 0], [p[0] + 0.4, p[1] + 0.4, 1.75]);
    const { object } = motion.at(f / pack.header.fps);
    const at = object && reach ? centreOfObject(pack, object) : p;
    const size = object && reach ? reach : 0.3;
    found.push(at.map((value) => value - size), at.map((value) => value + size));
  }
  return found;
}

/** Place of a joint of the person. @param {Motion} motion @param {Moment} now @param {string} name */
function jointOf({ header }, { joints }, name) {
  const first = 3 * header.joint_names.indexOf(name);
  return Array.from((joints ?? []).slice(first, first + 3));
}

/** Which way the person faces at a second, or square to the way that the phone goes.
 *  @param {Motion} motion @param {number} time */
export function facingOf(motion, time = 0) {
  const now = motion.at(time);
  if (now.joints) {
    const [left, right] = ["left_hip", "right_hip"].map((name) => jointOf(motion, now, name));
    const ahead = cross(left.map((v, k) => v - right[k]), [0, 0, 1]);
    return Math.atan2(ahead[1], ahead[0]);
  }
  const way = motion.way();
  const last = 3 * (motion.frames - 1);
  return Math.atan2(way[last + 1] - way[1], way[last] - way[0]) + Math.PI / 2;
}
