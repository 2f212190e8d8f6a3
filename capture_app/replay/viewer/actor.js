// One slot of the stage: a scene's surfaces and lines on the graphics card, and how they look now.

import { Lines, Mesh } from "./gpu.js";
import { Motion } from "./motion.js";
import { blend, FREE, HELD, LOST, MARK, MISSED, TINTS, TRACKING, TRAIL } from "./palette.js";
import { Picture } from "./picture.js";
import { ball, frustum, phone } from "./shapes.js";
import { facing, multiply, placed, point } from "./vectors.js";
/** @import {Character} from "./character.js"
 *  @import {Column} from "./gpu.js"
 *  @import {Moment} from "./motion.js"
 *  @import {Lens, Pack, Segment, Surface} from "./pack.js"
 *  @import {Theme} from "./palette.js"
 *  @import {Layers, Solid, Stroke} from "./stage.js" */

/** @typedef {WebGL2RenderingContext} Gl */
/** @typedef {Omit<Solid, "mesh" | "sheen"> & {sheen?: number}} Look */

const PALM_RADIUS = 0.03;
const PATCH_RADIUS = 0.042;
const PATCH_THICKNESS = 0.005;
/** Metres, and parts of how far the object goes: in a room a ball is larger. */
const MARK_RADIUS = 0.014;
const MARK_SHARE = 0.015;
const MISS = 0.01;
const HANDS = ["left", "right"];

export class Actor {
  /** `changed()` when more of it can be drawn.
   *  @param {Gl} gl @param {Pack} pack @param {number} slot @param {() => void} changed */
  constructor(gl, pack, slot, changed) {
    this.gl = gl;
    this.changed = changed;
    this.pack = pack;
    this.motion = new Motion(pack);
    this.tint = TINTS[slot % TINTS.length];
    /** @type {Segment[] | null} */
    this.edited = null;
    /** @type {number[][]} */
    this.marks = [];
    /** @type {Character | null} */
    this.character = null;
    this.markRadius = Math.max(MARK_RADIUS, MARK_SHARE * reachOf(pack));
    this.meshes = this.#meshes();
    this.lines = this.#lines();
    this.picture = Picture.of(gl, pack, changed);
  }

  get contacts() {
    return this.edited ?? this.motion.contacts();
  }

  /** Show a character, which does the same motion, in place of our body; null for our body again.
   *  @param {Character | null} character */
  setCharacter(character) {
    this.character?.dispose();
    this.character = null;
    character?.upload(this.gl, this.changed);
    this.character = character;
  }

  /** Puts everything on the card again after the card was lost. @param {Gl} gl */
  upload(gl) {
    this.gl = gl;
    this.meshes = this.#meshes();
    this.lines = this.#lines();
    this.picture = Picture.of(gl, this.pack, this.changed);
    this.character?.upload(gl, this.changed);
  }

  #meshes() {
    const { gl, pack } = this;
    return {
      body: this.#body(),
      object: this.#object(),
      ball: shape(gl, ball()),
      phone: pack.array("phone_position") ? shape(gl, phone()) : null,
    };
  }

  #lines() {
    const [view, miss] = [new Lines(this.gl), new Lines(this.gl)];
    return { path: this.#path(), trail: this.#trail(), view, miss };
  }

  dispose() {
    for (const thing of [...Object.values(this.meshes), ...Object.values(this.lines)]) {
      thing?.dispose();
    }
    this.picture?.dispose();
    this.character?.dispose();
  }

  /** What to draw at a second.
   *  @param {number} time @param {Layers} layers @param {Theme} theme @param {boolean} inPhone */
  act(time, layers, theme, inPhone) {
    const now = this.#now(time);
    /** @type {Solid[]} */
    const solids = [];
    /** @param {Mesh | null} mesh @param {Look} look */
    const put = (mesh, look) => mesh && solids.push({ mesh, sheen: theme.sheen, ...look });
    if (layers.body && this.character) {
      const { sheen } = theme;
      solids.push(...this.character.at(time).map((solid) => ({ ...solid, sheen, casts: true })));
    } else if (layers.body && now.bones) {
      put(this.meshes.body, { bones: now.bones, color: this.tint.body, casts: true });
    }
    if (layers.object && now.object) {
      const color = now.valid ? this.tint.object : LOST;
      const picture = now.valid ? this.picture : null;
      put(this.meshes.object, { place: now.object, color, casts: true, sheen: 0, picture });
    }
    if (layers.phone && now.phone && !inPhone) {
      put(this.meshes.phone, { place: now.phone, color: theme.phone, casts: true });
    }
    if (layers.contacts) this.#touch(now).forEach((look) => put(this.meshes.ball, look));
    this.marks.forEach((at) => put(this.meshes.ball, this.#marked(now, at)));
    return { solids, strokes: this.#strokes(now, layers, inPhone) };
  }

  // Palms are those of our body: a character's may be elsewhere.
  /** @param {number} time @returns {Moment} */
  #now(time) {
    const now = this.motion.at(time);
    return this.character ? { ...now, palms: [], held: [] } : now;
  }

  #body() {
    const [joints, weights] = [this.pack.array("skin_joints"), this.pack.array("skin_weights")];
    if (!joints || !weights) return null;
    return this.#mesh("body", [{ data: joints, width: 4 }, { data: weights, width: 4, normalized: true }]);
  }

  #object() {
    const uv = this.pack.array("object_uv");
    return this.#mesh("object", uv ? [{ data: uv, width: 2 }] : []);
  }

  /** @param {Surface} name @param {Column[]} more */
  #mesh(name, more) {
    const vertices = this.pack.array(`${name}_vertices`);
    if (!vertices) return null;
    /** @type {Column[]} */
    const columns = [
      { data: vertices, width: 3 },
      { data: this.pack.need(`${name}_normals`), width: 3, normalized: true },
      ...more,
    ];
    return new Mesh(this.gl, columns, this.pack.need(`${name}_faces`));
  }

  // The phone's way, by how well it was tracked; in a bare session with what it saw now and then.
  #path() {
    const lines = new Lines(this.gl);
    const way = this.pack.array("phone_position");
    if (!way) return lines;
    const tracking = this.pack.array("tracking");
    const pieces = [];
    for (let f = 1; f < this.motion.frames; f++) {
      const color = TRACKING[tracking ? Math.max(tracking[f - 1], tracking[f]) : 0];
      pieces.push(...way.subarray(3 * f - 3, 3 * f + 3), ...color, 0.9);
    }
    if (this.pack.header.kind === "session") pieces.push(...this.#sights());
    return lines.set(pieces);
  }

  #sights() {
    const every = Math.max(20, Math.ceil(this.motion.frames / 60));
    const pieces = [];
    for (let f = 0; f < this.motion.frames; f += every) {
      const { phone: T } = this.motion.at(f / this.pack.header.fps);
      if (T) pieces.push(...seen(this.pack.header.phone, T, 0.09, [...TRACKING[0], 0.35]));
    }
    return pieces;
  }

  #trail() {
    const lines = new Lines(this.gl);
    const vertices = this.pack.array("object_vertices");
    if (!vertices) return lines;
    const centre = middle(vertices);
    const { fps } = this.pack.header;
    const places = Array.from({ length: this.motion.frames }, (_, f) => {
      const { object } = this.motion.at(f / fps);
      return object && point(object, centre);
    });
    const way = places.filter((place) => place !== null);
    return lines.set(way.slice(1).flatMap((p, f) => [...way[f], ...p, ...TRAIL, 0.85]));
  }

  /** Palms, and the places that hands hold at this frame. @param {Moment} now */
  #touch(now) {
    const palms = now.palms.map((p, hand) => ({
      place: placed(p, PALM_RADIUS),
      color: blend(FREE, HELD, now.held[hand]),
    }));
    return [...palms, ...this.#held(now.frame).map((contact) => patch(contact, baseOf(now)))];
  }

  /** @param {number} frame */
  #held(frame) {
    const now = this.contacts.filter((c) => c.start <= frame && frame < c.stop);
    return now.filter(isHeld);
  }

  /** @param {Moment} now @param {number[]} at */
  #marked(now, at) {
    return { place: multiply(baseOf(now), placed(at, this.markRadius)), color: MARK };
  }

  /** @param {Moment} now @param {Layers} layers @param {boolean} inPhone */
  #strokes(now, layers, inPhone) {
    /** @type {Stroke[]} */
    const strokes = [];
    if (layers.trail) strokes.push({ lines: this.lines.trail, count: now.frame, width: 2.2 });
    if (layers.path) strokes.push({ lines: this.lines.path, width: 2.2 });
    if (layers.phone && now.phone && !inPhone) {
      const pieces = seen(this.pack.header.phone, now.phone, 0.3, [...TRACKING[0], 0.8]);
      strokes.push({ lines: this.lines.view.set(pieces), width: 1.4 });
    }
    if (layers.contacts && now.object) {
      strokes.push({ lines: this.lines.miss.set(this.#missed(now, now.object)), width: 3 });
    }
    return strokes;
  }

  /** From palms that miss their places to these.
   *  @param {Moment} now @param {Float32Array} T_world_object */
  #missed(now, T_world_object) {
    return this.#held(now.frame).flatMap((contact) => {
      const palm = now.palms[HANDS.indexOf(contact.hand)];
      const goal = point(T_world_object, contact.anchor);
      const off = palm ? Math.hypot(...palm.map((v, k) => v - goal[k])) : 0;
      return off > MISS ? [...palm, ...goal, ...MISSED, 1] : [];
    });
  }
}

/** Where the object is, or the world's origin where there is none. @param {Moment} now */
function baseOf(now) {
  return now.object ?? placed([0, 0, 0]);
}

/** @param {Segment} contact @returns {contact is Segment & {anchor: number[]}} */
function isHeld(contact) {
  return Boolean(contact.anchor);
}

/** @param {Segment & {anchor: number[]}} contact @param {Float32Array} T_world_object */
function patch(contact, T_world_object) {
  const at = contact.place && contact.normal
    ? facing(contact.normal, contact.place, PATCH_RADIUS, PATCH_THICKNESS)
    : placed(contact.anchor, PALM_RADIUS);
  return { place: multiply(T_world_object, at), color: HELD };
}

/** @param {Lens | null} lens @param {Float32Array} T @param {number} depth @param {number[]} color */
function seen(lens, T, depth, color) {
  return frustum(lens, depth).flatMap(([a, b]) => [...point(T, a), ...point(T, b), ...color]);
}

/** @param {Gl} gl @param {ReturnType<typeof ball>} of */
function shape(gl, { vertices, normals, faces }) {
  return new Mesh(gl, [{ data: vertices, width: 3 }, { data: normals, width: 3 }], faces);
}

/** @param {ArrayLike<number>} vertices */
export function middle(vertices) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < vertices.length; k++) {
    low[k % 3] = Math.min(low[k % 3], vertices[k]);
    high[k % 3] = Math.max(high[k % 3], vertices[k]);
  }
  return low.map((value, k) => (value + high[k]) / 2);
}

/** How far the object goes from its middle, metres. @param {Pack} pack */
export function reachOf(pack) {
  const vertices = pack.array("object_vertices");
  if (!vertices) return 0;
  const centre = middle(vertices);
  let most = 0;
  for (let v = 0; v < vertices.length; v += 3) {
    most = Math.max(most, Math.hypot(...centre.map((c, k) => vertices[v + k] - c)));
  }
  return most;
}
