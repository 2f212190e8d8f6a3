// One slot of the stage: a scene's surfaces and lines on the graphics card, and how they look now.

import { Lines, Mesh } from "./gpu.js";
import { Motion } from "./motion.js";
import { blend, FREE, HELD, LOST, MARK, MISSED, TINTS, TRACKING, TRAIL } from "./palette.js";
import { ball, frustum, phone } from "./shapes.js";
import { facing, multiply, placed, point } from "./vectors.js";

const PALM_RADIUS = 0.03;
const PATCH_RADIUS = 0.042;
const PATCH_THICKNESS = 0.005;
const MARK_RADIUS = 0.014;
const MISS = 0.01;
const HANDS = ["left", "right"];

export class Actor {
  constructor(gl, pack, slot) {
    this.gl = gl;
    this.pack = pack;
    this.motion = new Motion(pack);
    this.tint = TINTS[slot % TINTS.length];
    this.edited = null;
    this.marks = [];
    this.upload(gl);
  }

  get contacts() {
    return this.edited ?? this.motion.contacts();
  }

  // Puts everything on the card; again after the card was lost.
  upload(gl) {
    this.gl = gl;
    this.meshes = {
      body: this.#mesh("body", [
        { data: this.pack.array("skin_joints"), width: 4 },
        { data: this.pack.array("skin_weights"), width: 4, normalized: true },
      ]),
      object: this.#mesh("object", []),
      ball: shape(gl, ball()),
      phone: this.pack.array("phone_position") ? shape(gl, phone()) : null,
    };
    this.lines = { path: this.#path(), trail: this.#trail(), view: new Lines(gl), miss: new Lines(gl) };
  }

  dispose() {
    for (const thing of [...Object.values(this.meshes), ...Object.values(this.lines)]) {
      thing?.dispose();
    }
  }

  // What to draw at a second.
  act(time, layers, theme, inPhone) {
    const now = this.motion.at(time);
    const solids = [];
    const put = (mesh, look) => mesh && solids.push({ mesh, sheen: theme.sheen, ...look });
    if (layers.body && now.bones) {
      put(this.meshes.body, { bones: now.bones, color: this.tint.body, casts: true });
    }
    if (layers.object && now.object) {
      const color = now.valid ? this.tint.object : LOST;
      put(this.meshes.object, { place: now.object, color, casts: true, sheen: 0 });
    }
    if (layers.phone && now.phone && !inPhone) {
      put(this.meshes.phone, { place: now.phone, color: theme.phone, casts: true });
    }
    if (layers.contacts) this.#touch(now).forEach((look) => put(this.meshes.ball, look));
    this.marks.forEach((at) => put(this.meshes.ball, this.#marked(now, at)));
    return { solids, strokes: this.#strokes(now, layers, inPhone) };
  }

  #mesh(name, more) {
    const vertices = this.pack.array(`${name}_vertices`);
    if (!vertices) return null;
    const columns = [
      { data: vertices, width: 3 },
      { data: this.pack.array(`${name}_normals`), width: 3, normalized: true },
      ...more,
    ];
    return new Mesh(this.gl, columns, this.pack.array(`${name}_faces`));
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
      pieces.push(...seen(this.pack.header.phone, T, 0.09, [...TRACKING[0], 0.35]));
    }
    return pieces;
  }

  #trail() {
    const lines = new Lines(this.gl);
    if (!this.meshes.object) return lines;
    const centre = middle(this.pack.array("object_vertices"));
    const { fps } = this.pack.header;
    const way = Array.from({ length: this.motion.frames }, (_, f) =>
      point(this.motion.at(f / fps).object, centre),
    );
    return lines.set(way.slice(1).flatMap((p, f) => [...way[f], ...p, ...TRAIL, 0.85]));
  }

  // Palms, and the places that hands hold at this frame.
  #touch(now) {
    const palms = now.palms.map((p, hand) => ({
      place: placed(p, PALM_RADIUS),
      color: blend(FREE, HELD, now.held[hand]),
    }));
    return [...palms, ...this.#held(now.frame).map((contact) => patch(contact, now.object))];
  }

  #held(frame) {
    return this.contacts.filter((c) => c.anchor && c.start <= frame && frame < c.stop);
  }

  #marked(now, at) {
    const base = now.object ?? placed([0, 0, 0]);
    return { place: multiply(base, placed(at, MARK_RADIUS)), color: MARK };
  }

  #strokes(now, layers, inPhone) {
    const strokes = [];
    if (layers.trail) strokes.push({ lines: this.lines.trail, count: now.frame, width: 2.2 });
    if (layers.path) strokes.push({ lines: this.lines.path, width: 2.2 });
    if (layers.phone && now.phone && !inPhone) {
      const pieces = seen(this.pack.header.phone, now.phone, 0.3, [...TRACKING[0], 0.8]);
      strokes.push({ lines: this.lines.view.set(pieces), width: 1.4 });
    }
    if (layers.contacts && now.object) {
      strokes.push({ lines: this.lines.miss.set(this.#missed(now)), width: 3 });
    }
    return strokes;
  }

  // From palms that miss their places to these.
  #missed(now) {
    return this.#held(now.frame).flatMap((contact) => {
      const palm = now.palms[HANDS.indexOf(contact.hand)];
      const goal = point(now.object, contact.anchor);
      const off = palm ? Math.hypot(...palm.map((v, k) => v - goal[k])) : 0;
      return off > MISS ? [...palm, ...goal, ...MISSED, 1] : [];
    });
  }
}

function patch(contact, T_world_object) {
  const at = contact.place
    ? facing(contact.normal, contact.place, PATCH_RADIUS, PATCH_THICKNESS)
    : placed(contact.anchor, PALM_RADIUS);
  return { place: multiply(T_world_object, at), color: HELD };
}

function seen(lens, T, depth, color) {
  return frustum(lens, depth).flatMap(([a, b]) => [...point(T, a), ...point(T, b), ...color]);
}

function shape(gl, { vertices, normals, faces }) {
  return new Mesh(gl, [{ data: vertices, width: 3 }, { data: normals, width: 3 }], faces);
}

export function middle(vertices) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  vertices.forEach((value, k) => {
    low[k % 3] = Math.min(low[k % 3], value);
    high[k % 3] = Math.max(high[k % 3], value);
  });
  return low.map((value, k) => (value + high[k]) / 2);
}
