// The viewer of scene packs: plays, shows and picks. docs/replay.md tells how a page uses it.

import { Actor } from "./actor.js";
import { Camera, ray } from "./camera.js";
import { control } from "./controls.js";
import { readPack } from "./pack.js";
import { THEMES } from "./palette.js";
import { onFloor, pickObject } from "./pick.js";
import { panesOf, pixels, projected } from "./panes.js";
import { Stage } from "./stage.js";
import { Surface } from "./surface.js";
import { multiply, point, rigidInverse } from "./vectors.js";

const LAYERS = ["body", "object", "phone", "path", "contacts", "trail", "grid", "shadow"];

export async function createViewer(canvas) {
  return new Viewer(canvas);
}

class Viewer extends EventTarget {
  #surface;
  #stage;
  #camera = new Camera();
  #actors = new Map();
  #layers = Object.fromEntries(LAYERS.map((name) => [name, true]));
  #arranged = "side";
  #time = 0;
  #playing = false;
  #asked = 0;
  #drawn = null;
  #theme = "auto";
  #release;

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

  get cameraMode() {
    return this.#camera.mode;
  }

  get layers() {
    return { ...this.#layers };
  }

  async load(buffer, { slot = 0, sample } = {}) {
    const actor = new Actor(this.#surface.gl, readPack(buffer), slot);
    this.#actors.get(slot)?.dispose();
    this.#actors.set(slot, actor);
    if (sample !== undefined) actor.motion.sample = sample;
    if (this.#actors.size === 1) this.frameAll();
    this.#tell("loaded", { slot, header: actor.pack.header });
    this.#change();
  }

  unload(slot) {
    this.#actors.get(slot)?.dispose();
    this.#actors.delete(slot);
    this.#tell("unloaded", { slot });
    this.#change();
  }

  seek(time) {
    const wanted = Math.min(Math.max(time, 0), this.duration);
    if (wanted === this.#time) return;
    this.#time = wanted;
    this.#tell("time", { time: wanted });
    this.#change();
  }

  play() {
    if (this.#playing || !this.duration) return;
    if (this.#time >= this.duration) this.seek(0);
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

  camera(mode) {
    this.#camera.set(mode);
    this.#tell("camera", { mode });
    this.#change();
  }

  frameAll() {
    const motions = [...this.#actors.values()].map((actor) => actor.motion);
    if (motions.length) this.#camera.frame(motions);
    this.#change();
  }

  show(layers) {
    for (const name of LAYERS) if (name in layers) this.#layers[name] = Boolean(layers[name]);
    this.#tell("layers", this.layers);
    this.#change();
  }

  sample(slot, k) {
    const actor = this.#actor(slot);
    actor.motion.sample = k;
    actor.edited = null;
    this.#tell("sample", { slot, sample: k });
    this.#change();
  }

  header(slot) {
    return this.#actors.get(slot)?.pack.header ?? null;
  }

  pack(slot) {
    return this.#actors.get(slot)?.pack ?? null;
  }

  arrange(how) {
    if (how !== "side" && how !== "over") throw new Error(`there is no arrangement ${how}`);
    this.#arranged = how;
    this.#change();
  }

  // Where each slot is shown, in CSS pixels of the canvas.
  panes() {
    const slots = [...this.#actors.keys()].sort((a, b) => a - b);
    const { clientWidth, clientHeight } = this.#surface.canvas;
    return panesOf(slots, this.#arranged, clientWidth, clientHeight);
  }

  contacts(slot, segments) {
    this.#actor(slot).edited = segments;
    this.#change();
  }

  mark(slot, points) {
    this.#actor(slot).marks = points;
    this.#change();
  }

  pick(x, y) {
    let best = null;
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

  // The floor of the first scene under a point of the picture; null above the horizon.
  floor(x, y) {
    return onFloor(this.#ray(this.panes()[0], x, y));
  }

  // A point of the world in the axes of a slot's object, as it is now.
  fromObject(place, slot = 0) {
    return point(rigidInverse(this.#actor(slot).motion.at(this.#time).object), place);
  }

  #ray(pane, x, y) {
    return ray(this.#view(pane), (2 * (x - pane.x)) / pane.width - 1, 1 - (2 * y) / pane.height);
  }

  // Where a point of the world is in a slot's picture: {x, y, depth}, CSS pixels and metres.
  project(place, slot = 0) {
    const pane = this.panes().find((shown) => shown.slot === slot);
    const { T_world_camera: T, projection } = this.#view(pane);
    return projected(multiply(projection, rigidInverse(T)), pane, place);
  }

  joints(slot) {
    const { joints } = this.#actor(slot).motion.at(this.#time);
    return joints ? Float32Array.from(joints) : null;
  }

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
    const theme = THEMES[this.#dark() ? "dark" : "light"];
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
  }

  #view(pane) {
    return this.#camera.view(this.#actor(pane.slot).motion, this.#time, pane.width / pane.height);
  }

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

  #dark() {
    if (this.#theme !== "auto") return this.#theme === "dark";
    return matchMedia("(prefers-color-scheme: dark)").matches;
  }

  #change() {
    if (!this.#asked) this.#asked = requestAnimationFrame((now) => this.#tick(now));
  }

  #tick(now) {
    this.#asked = 0;
    if (this.#playing) {
      if (this.#drawn !== null) this.#advance(((now - this.#drawn) / 1000) * this.speed);
      this.#drawn = now;
      if (this.#playing) this.#change();
    }
    this.draw();
  }

  #advance(seconds) {
    const { duration } = this;
    const next = this.#time + seconds;
    if (next <= duration) this.seek(next);
    else if (this.loop) this.seek(next % duration);
    else {
      this.seek(duration);
      this.pause();
    }
  }

  #tell(kind, detail) {
    this.dispatchEvent(new CustomEvent(kind, { detail }));
  }
}
