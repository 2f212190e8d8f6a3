// The viewer of scene packs: plays, shows and picks. docs/replay.md tells how a page uses it.

import { Actor } from "./actor.js";
import { Camera, centreOfObject, ray } from "./camera.js";
import { HANDS } from "./contact_edits.js";
import { control } from "./controls.js";
import { Motion } from "./motion.js";
import { readPack } from "./pack.js";
import { themeOf } from "./palette.js";
import { onFloor, pickObject } from "./pick.js";
import { panesOf, pixels, projected } from "./panes.js";
import { playedOn } from "./playback.js";
import { Stage } from "./stage.js";
import { Surface } from "./surface.js";
import { multiply, point, rigidInverse } from "./vectors.js";
/** @import {Character} from "./character.js" @import {Pack, Segment} from "./pack.js"
 *  @import {Pane} from "./panes.js" @import {Picked} from "./pick.js" */

const LAYERS = ["body", "object", "phone", "path", "contacts", "trail", "grid", "shadow"];

/** @param {HTMLCanvasElement} canvas */
export async function createViewer(canvas) {
  return new Viewer(canvas);
}

export class Viewer extends EventTarget {
  #surface;
  #stage;
  #camera = new Camera();
  #actors = /** @type {Map<number, Actor>} */ (new Map());
  /** @type {Record<string, boolean>} */
  #layers = Object.fromEntries(LAYERS.map((name) => [name, true]));
  #arranged = "side";
  #time = 0;
  #playing = false;
  #asked = 0;
  #drawn = /** @type {number | null} */ (null);
  #stretch = /** @type {number[] | null} */ (null);
  #theme = "auto";
  #release;

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    super();
    this.speed = 1;
    this.loop = true;
    this.#surface = new Surface(canvas, () => this.#change(), () => this.#restore());
    this.#stage = new Stage(this.#surface.gl);
    this.#release = control(canvas, this.#camera, () => this.#change());
  }

  get time() {
    return this.#time;
  }

  get duration() {
    return Math.max(0, ...[...this.#actors.values()].map((actor) => actor.motion.duration));
  }

  get playing() {
    return this.#playing;
  }

  /** The seconds that are played over and over; null for the whole. @param {number[] | null} seconds */
  set stretch(seconds) {
    this.#stretch = seconds;
    this.#tell("stretch", {});
  }

  get stretch() {
    const [start, end] = (this.#stretch ?? []).map((time) => Math.min(time, this.duration));
    return end - start > 0 ? [start, end] : null;
  }

  get cameraMode() {
    return this.#camera.mode;
  }

  get layers() {
    return { ...this.#layers };
  }

  /** @param {ArrayBuffer} buffer @param {{slot?: number, sample?: number}} where */
  async load(buffer, { slot = 0, sample } = {}) {
    const actor = new Actor(this.#surface.gl, readPack(buffer), slot, () => this.#change());
    this.#actors.get(slot)?.dispose();
    this.#actors.set(slot, actor);
    if (sample !== undefined) actor.motion.sample = sample;
    if (this.#actors.size === 1) this.frameAll();
    this.#tell("loaded", { slot, header: actor.pack.header });
    this.#change();
  }

  /** Another motion of the same things, from here on. @param {number} slot @param {Pack} pack */
  revise(slot, pack) {
    const actor = this.#actor(slot);
    const motion = new Motion(pack);
    motion.sample = actor.motion.sample;
    Object.assign(actor, { pack, motion });
    this.#tell("unloaded", { slot });
    this.#change();
  }

  /** Show a character in place of our body in a slot; null for our body again.
   *  @param {number} slot @param {Character | null} character */
  setCharacter(slot, character) {
    this.#actor(slot).setCharacter(character);
    this.#change();
  }

  /** @param {number} slot */
  unload(slot) {
    this.#actors.get(slot)?.dispose();
    this.#actors.delete(slot);
    this.#tell("unloaded", { slot });
    this.#change();
  }

  /** @param {number} time */
  seek(time) {
    const wanted = Math.min(Math.max(time, 0), this.duration);
    if (wanted === this.#time) return;
    this.#time = wanted;
    this.#tell("time", { time: wanted });
    this.#change();
  }

  play() {
    if (this.#playing || !this.duration) return;
    const [start, end] = this.stretch ?? [0, this.duration];
    if (this.#time >= end) this.seek(start);
    this.#playing = true;
    this.#drawn = null;
    this.#tell("play", {});
    this.#change();
  }

  pause() {
    if (!this.#playing) return;
    this.#playing = false;
    this.#tell("pause", {});
  }

  /** By whole frames; playing ends. @param {number} frames */
  step(frames) {
    this.pause();
    const fps = this.header(0)?.fps ?? 30;
    this.seek(Math.round(this.#time * fps + frames) / fps);
  }

  /** @param {string} mode */
  camera(mode) {
    const [first] = this.#actors.values();
    this.#camera.set(mode, first?.motion, this.#time);
    this.#tell("camera", { mode });
    this.#change();
  }

  frameAll() {
    const motions = [...this.#actors.values()].map((actor) => actor.motion);
    if (motions.length) this.#camera.frame(motions);
    this.#change();
  }

  /** @param {Record<string, boolean>} layers */
  show(layers) {
    for (const name of LAYERS) if (name in layers) this.#layers[name] = Boolean(layers[name]);
    this.#tell("layers", this.layers);
    this.#change();
  }

  /** @param {number} slot @param {number} k */
  sample(slot, k) {
    const actor = this.#actor(slot);
    actor.motion.sample = k;
    actor.edited = null;
    this.#tell("sample", { slot, sample: k });
    this.#change();
  }

  /** @param {number} slot */
  header(slot) {
    return this.#actors.get(slot)?.pack.header ?? null;
  }

  /** @param {number} slot */
  pack(slot) {
    return this.#actors.get(slot)?.pack ?? null;
  }

  /** @param {string} how */
  arrange(how) {
    if (how !== "side" && how !== "over") throw new Error(`there is no arrangement ${how}`);
    this.#arranged = how;
    this.#change();
  }

  // Where each slot is shown, in CSS pixels of the canvas.
  panes() {
    const slots = [...this.#actors.keys()].sort((a, b) => a - b);
    const { clientWidth: width, clientHeight: height } = this.#surface.canvas;
    return panesOf(slots, this.#arranged, width, height);
  }

  /** @param {number} slot @param {Segment[] | null} segments */
  contacts(slot, segments) {
    this.#actor(slot).edited = segments;
    this.#change();
  }

  /** @param {number} slot @param {number[][]} points */
  mark(slot, points) {
    this.#actor(slot).marks = points;
    this.#change();
  }

  /** @param {number} x @param {number} y */
  pick(x, y) {
    let best = /** @type {Picked & {slot: number} | null} */ (null);
    for (const pane of this.panes()) {
      if (x < pane.x || x >= pane.x + pane.width) continue;
      const { motion, pack } = this.#actor(pane.slot);
      const { object } = motion.at(this.#time);
      if (!object || !this.#layers.object) continue;
      const found = pickObject(pack, object, this.#ray(pane, x, y));
      if (found && (!best || found.distance < best.distance)) best = { ...found, slot: pane.slot };
    }
    return best;
  }

  /** The floor under a point of the picture; null above the horizon. @param {number} x @param {number} y */
  floor(x, y) {
    return onFloor(this.#ray(this.panes()[0], x, y));
  }

  /** The moment amid the first hold of a slot's sample, seconds. */
  heldAt(slot = 0) {
    return this.#actor(slot).motion.heldAt();
  }

  /** Where on the floor the opposite side of a slot's object is, seen from the person, as they are now. */
  opposite(slot = 0) {
    const { motion, pack } = this.#actor(slot);
    const { object, joints } = motion.at(this.#time);
    if (!object || !joints) return null;
    const centre = centreOfObject(pack, object);
    return [0, 1].map((k) => 2 * centre[k] - joints[k]);
  }

  /** A point of the world in the axes of a slot's object, as it is now.
   *  @param {number[]} place @param {number} slot */
  fromObject(place, slot = 0) {
    const { object } = this.#actor(slot).motion.at(this.#time);
    if (!object) throw new Error(`slot ${slot} has no object`);
    return point(rigidInverse(object), place);
  }

  /** @param {Pane} pane @param {number} x @param {number} y */
  #ray(pane, x, y) {
    return ray(this.#view(pane), (2 * (x - pane.x)) / pane.width - 1, 1 - (2 * y) / pane.height);
  }

  /** Where a point of the world is in a slot's picture: {x, y, depth}, CSS pixels and metres.
   *  @param {number[]} place @param {number} slot */
  project(place, slot = 0) {
    const [pane] = this.panes().filter((shown) => shown.slot === slot);
    const { T_world_camera: T, projection } = this.#view(pane);
    return projected(multiply(projection, rigidInverse(T)), pane, place);
  }

  /** Where a contact of the first slot is in its picture: its place on the object, or its palm without one.
   *  @param {Segment} contact */
  contactAt({ hand, place, anchor }) {
    const { object, palms } = this.#actor(0).motion.at(this.#time);
    const at = place ?? anchor;
    return this.project(at && object ? point(object, at) : palms[HANDS.indexOf(hand)]);
  }

  /** @param {number} slot */
  joints(slot) {
    const { joints } = this.#actor(slot).motion.at(this.#time);
    return joints ? Float32Array.from(joints) : null;
  }

  /** @param {string} name */
  theme(name) {
    this.#theme = name;
    this.#change();
  }

  dispose() {
    this.pause();
    cancelAnimationFrame(this.#asked);
    this.#release();
    this.#surface.dispose();
    this.#actors.forEach((actor) => actor.dispose());
    this.#actors.clear();
    this.#stage.dispose();
  }

  draw() {
    if (!this.#surface.drawable) return;
    const theme = themeOf(this.#theme);
    const ratio = this.#surface.fit();
    const panes = this.panes();
    const groups = this.#arranged === "over" ? [panes] : panes.map((pane) => [pane]);
    for (const group of groups.filter((some) => some.length)) {
      const [pane] = group;
      const view = { ...this.#view(pane), ratio };
      const inPhone = this.#camera.mode === "phone";
      const scenes = group.map(({ slot }) =>
        this.#actor(slot).act(this.#time, this.#layers, theme, inPhone),
      );
      this.#stage.draw(pixels(pane, ratio), view, scenes, theme, this.#layers);
    }
    if (!panes.length) this.#surface.clear(theme.background);
    this.#tell("drawn", {});
  }

  /** @param {Pane} pane */
  #view(pane) {
    return this.#camera.view(this.#actor(pane.slot).motion, this.#time, pane.width / pane.height);
  }

  /** @param {number} slot */
  #actor(slot) {
    const actor = this.#actors.get(slot);
    if (!actor) throw new Error(`slot ${slot} is empty`);
    return actor;
  }

  #restore() {
    this.#stage = new Stage(this.#surface.gl);
    this.#actors.forEach((actor) => actor.upload(this.#surface.gl));
    this.#change();
  }

  #change() {
    if (!this.#asked) this.#asked = requestAnimationFrame((now) => this.#tick(now));
  }

  /** @param {number} now */
  #tick(now) {
    this.#asked = 0;
    if (this.#playing) {
      if (this.#drawn !== null) this.#advance(((now - this.#drawn) / 1000) * this.speed);
      this.#drawn = now;
      if (this.#playing) this.#change();
    }
    this.draw();
  }

  /** @param {number} seconds */
  #advance(seconds) {
    const stretch = this.stretch ?? [0, this.duration];
    const { time, stops } = playedOn(this.#time, seconds, stretch, this.loop);
    this.seek(time);
    if (stops) this.pause();
  }

  /** @param {string} kind @param {object} detail */
  #tell(kind, detail) {
    this.dispatchEvent(new CustomEvent(kind, { detail }));
  }
}
