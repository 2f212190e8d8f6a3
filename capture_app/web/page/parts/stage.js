// The 3D view with its clock: play, speed, cameras, layers, and a timeline for each scene.
import { bytes, inWords } from "../core/api.js";
import { box, h, hintLine, put } from "../core/dom.js";
import { trouble } from "./trouble.js";
/** @import {Character} from "/static/viewer/character.js"
 *  @import {Film} from "/static/viewer/film.js"
 *  @import {Pack} from "/static/viewer/pack.js"
 *  @import {Timeline} from "/static/viewer/timeline.js"
 *  @import {Viewer} from "/static/viewer/viewer.js" */

/** What is shown in a slot; `pack`: its bytes, where they were asked for already; `film`: asks for what the
 *  phone filmed, where the scene comes without it; `plain`: without a timeline.
 *  @typedef {{url: string, name: string, pack?: Promise<ArrayBuffer>, film?: () => Promise<ArrayBuffer>,
 *    sample?: number, plain?: boolean}} Scene */
/** Who takes the clicks on the picture. @typedef {{letGo: () => void}} Owner */

/** A 3D view that lives until `signal` is raised. */
export class Stage extends EventTarget {
  /** @type {Viewer | null} */
  viewer = null;
  /** @type {Timeline[]} */
  timelines = [];
  /** @type {number[][]} */
  points = [];
  /** @type {Scene[]} */
  scenes = [];
  /** @type {Film | null} */
  film = null;
  /** @type {Owner | null} */
  picker = null;
  /** A character of the visitor's, and the sample whose motion it does.
   *  @type {{character: Character, sample: number} | null} */
  ownCharacter = null;
  /** Whether the camera has been put where it shows most; from then on it is the user's. */
  aimed = false;

  /** @param {{label: string, signal: AbortSignal, controls?: boolean}} asked */
  constructor({ label, signal, controls = true }) {
    super();
    this.signal = signal;
    this.controls = controls;
    this.canvas = h("canvas", {
      tabindex: "0",
      role: "img",
      "aria-label": `${label}. Arrow keys turn the view, plus and minus come nearer and go away.`,
    });
    // They are fetched together and at once, because a motion is seen only when all of them are there.
    this.modules = Promise.all([
      import("/static/viewer/viewer.js"),
      import("./stage_controls.js"),
      import("/static/viewer/timeline.js"),
      import("/static/viewer/film.js"),
      import("/static/viewer/pack.js"),
    ]).then(([viewer, bar, timeline, film, pack]) => ({ ...viewer, ...bar, ...timeline, ...film, ...pack }));
    // A failure is shown by whoever waits for them.
    this.modules.catch(() => {});
    this.down = [0, 0];
    this.canvas.addEventListener("pointerdown", (event) => {
      this.down = [event.offsetX, event.offsetY];
    });
    this.names = box("stage-names");
    this.message = box("stage-message");
    this.picture = box("stage-film");
    this.frame = box("stage-frame", this.canvas, this.names, this.picture, this.message);
    this.side = box("stage-side");
    this.bar = box("stage-bar");
    this.person = h(
      "select",
      { on: { change: () => this.showPerson() } },
      h("option", { value: "own" }, "Character"),
      h("option", { value: "" }, "Our body"),
    );
    this.who = h("label", { class: "inline", hidden: true }, h("span", {}, "Person"), this.person);
    this.tracks = box("stage-tracks");
    this.node = h(
      "div",
      { class: controls ? "stage full" : "stage" },
      box("stage-middle", this.frame, this.side),
      this.bar,
      this.tracks,
    );
  }

  /** Show scenes [{url, name, sample?}] in slots 0, 1, ... in place of what was shown.
   *  @param {Scene[]} scenes */
  async open(scenes) {
    put(this.message, h("p", { class: "waiting" }, "Setting up the scene…"));
    try {
      // The server packs the scenes while the viewer is made.
      const coming = scenes.map(({ url, pack }) => pack ?? bytes(url, this.signal));
      const [viewer, ...packs] = await Promise.all([this.ready(), ...coming]);
      if (viewer) await this.load(viewer, scenes, packs);
      put(this.message);
    } catch (error) {
      if (this.signal.aborted) return;
      const without = error instanceof Error && error.message === "webgl";
      put(this.message, without ? withoutWebGL() : trouble(inWords(error)));
    }
  }

  /** The viewer, made the first time; null when the view was left meanwhile. */
  async ready() {
    if (this.viewer) return this.viewer;
    const { createViewer, stageControls } = await this.modules;
    if (this.signal.aborted) return null;
    const viewer = await createViewer(this.canvas);
    this.viewer = viewer;
    this.signal.addEventListener("abort", () => this.close());
    if (!this.controls) return viewer;
    viewer.addEventListener("time", () => this.tick(viewer));
    viewer.addEventListener("stretch", () => this.tick(viewer));
    const controls = stageControls(viewer, this.node, this.signal);
    put(this.bar, controls.slice(0, -1), this.who, controls.slice(-1));
    return viewer;
  }

  /** @param {Viewer} viewer @param {Scene[]} scenes @param {ArrayBuffer[]} packs */
  async load(viewer, scenes, packs) {
    for (const slot of this.scenes.keys()) viewer.unload(slot);
    this.scenes = scenes;
    for (const [slot, pack] of packs.entries()) {
      await viewer.load(pack, { slot, sample: scenes[slot].sample });
    }
    if (this.signal.aborted) return;
    this.showPerson();
    const motion = !this.aimed && Boolean(viewer.pack(0)?.array("root"));
    if (motion) viewer.camera("follow");
    this.aimed = true;
    // The new scene may be shorter than what was shown before.
    viewer.seek(viewer.time);
    await this.drawTracks(viewer);
    // The motion can be used without its film: where the film cannot be shown, its corner stays empty.
    this.showFilm(viewer).catch(() => put(this.picture));
    this.label();
    this.mark(this.points);
    if (motion && !matchMedia("(prefers-reduced-motion: reduce)").matches) viewer.play();
    this.dispatchEvent(new Event("opened"));
  }

  /** A scene over the first one, or none. @param {ArrayBuffer | null} pack */
  async over(pack) {
    const viewer = await this.ready();
    if (!viewer?.header(0)) return;
    viewer.arrange("over");
    if (pack) await viewer.load(pack, { slot: 1 });
    else viewer.unload(1);
  }

  /** Show a character where a sample is shown alone. @param {ArrayBuffer} glb with that sample's motion
   *  @param {number} sample */
  async showCharacter(glb, sample) {
    const { Character } = await import("/static/viewer/character.js");
    this.ownCharacter = { character: new Character(glb), sample };
    this.person.value = "own";
    try {
      this.showPerson();
    } catch (error) {
      this.ownCharacter = null;
      this.showPerson();
      throw error;
    }
  }

  /** The person as it is chosen: the character, which does the motion of one sample, or our body. */
  showPerson() {
    const [scene, ...others] = this.scenes;
    const own = scene && !others.length && this.ownCharacter?.sample === (scene.sample ?? 0) ? this.ownCharacter : null;
    this.who.hidden = !own;
    if (scene) this.viewer?.setCharacter(0, own && this.person.value ? own.character : null);
  }

  /** The scene that is shown, with another motion, which is not the character's. @param {Pack} pack */
  revise(pack) {
    this.ownCharacter = null;
    this.showPerson();
    this.viewer?.revise(0, pack);
    for (const timeline of this.timelines) timeline.pack = pack;
    this.dispatchEvent(new Event("revised"));
  }

  /** @param {Viewer} viewer */
  async drawTracks(viewer) {
    this.timelines.forEach((one) => one.dispose());
    this.timelines = [];
    put(this.tracks);
    const { createTimeline } = await this.modules;
    for (const [slot, scene] of this.scenes.entries()) {
      const pack = viewer.pack(slot);
      if (!this.controls || !pack || pack.header.frames < 2 || scene.plain) continue;
      const timeline = createTimeline(this.track(scene), pack, { sample: scene.sample });
      timeline.addEventListener("seek", () => {
        viewer.pause();
        viewer.seek(timeline.time);
      });
      timeline.addEventListener("stretch", (event) => {
        if (event instanceof CustomEvent) viewer.stretch = event.detail.stretch;
      });
      this.timelines.push(timeline);
    }
    this.tick(viewer);
  }

  /** Where the timeline of a scene goes. @param {Scene} scene */
  track({ name }) {
    const host = box("stage-track");
    this.tracks.append(this.scenes.length > 1 ? hintLine(name) : "", host);
    return host;
  }

  /** @param {Viewer} viewer */
  tick({ time, stretch }) {
    for (const timeline of this.timelines) Object.assign(timeline, { time, stretch });
    if (this.film) this.film.time = time;
  }

  /** What the phone filmed, in a corner, where one recording is shown.
   *  @param {Viewer} viewer */
  async showFilm(viewer) {
    this.film?.dispose();
    this.film = null;
    put(this.picture);
    const scenes = this.scenes;
    if (scenes.length !== 1) return;
    const { createFilm, readPack } = await this.modules;
    const pack = scenes[0].film ? readPack(await scenes[0].film()) : viewer.pack(0);
    if (this.signal.aborted || this.scenes !== scenes || !pack) return;
    this.film = createFilm(pack);
    put(this.picture, this.film?.element);
    if (this.film) this.film.time = viewer.time;
  }

  /** Names over the panes of a comparison. */
  label() {
    if (this.scenes.length < 2 || !this.viewer) {
      put(this.names);
      return;
    }
    put(
      this.names,
      this.viewer
        .panes()
        .map(({ slot, x, y, width }) =>
          h("span", { style: { left: `${x}px`, top: `${y}px`, width: `${width}px` } }, this.scenes[slot]?.name ?? ""),
        ),
    );
  }

  /** Balls at points of the first scene's object; kept for the next scene.
   *  @param {number[][]} points */
  mark(points) {
    this.points = points;
    if (this.viewer?.header(0)) this.viewer.mark(0, points);
  }

  /** Whether a click on the picture is but the end of a drag that turned the view.
   *  @param {MouseEvent} event */
  dragged({ offsetX, offsetY }) {
    return Math.hypot(offsetX - this.down[0], offsetY - this.down[1]) > 4;
  }

  /** Whose the clicks on the picture are: of one part at a time. @param {Owner | null} owner */
  clicksFor(owner) {
    const before = this.picker;
    this.picker = owner;
    this.canvas.classList.toggle("picking", Boolean(owner));
    if (before && before !== owner) before.letGo();
  }

  close() {
    this.timelines.forEach((one) => one.dispose());
    this.film?.dispose();
    this.viewer?.dispose();
    this.viewer = null;
  }
}

function withoutWebGL() {
  return trouble({
    what: "This browser draws no 3D.",
    fix:
      "Switch hardware acceleration (WebGL 2) on in its settings, or use another " +
      "browser. Videos and downloads work without it.",
  });
}
