// The 3D view with its clock: play, speed, cameras, layers, and a timeline for each scene.
import { bytes, inWords } from "../core/api.js";
import { h, put } from "../core/dom.js";
import { stageControls } from "./stage_controls.js";
import { trouble } from "./trouble.js";

/** A 3D view that lives until `signal` is raised. */
export class Stage extends EventTarget {
  viewer = null;
  timelines = [];
  points = [];

  constructor({ label, signal, controls = true }) {
    super();
    Object.assign(this, { signal, controls });
    this.canvas = h("canvas", {
      tabindex: "0",
      role: "img",
      "aria-label": `${label}. Arrow keys turn the view, plus and minus come nearer and go away.`,
    });
    this.down = [0, 0];
    this.canvas.addEventListener("pointerdown", (event) => {
      this.down = [event.offsetX, event.offsetY];
    });
    this.names = h("div", { class: "stage-names" });
    this.message = h("div", { class: "stage-message" });
    this.picture = h("div", { class: "stage-film" });
    this.frame = h(
      "div",
      { class: "stage-frame" },
      this.canvas,
      this.names,
      this.picture,
      this.message,
    );
    this.bar = h("div", { class: "stage-bar" });
    this.tracks = h("div", { class: "stage-tracks" });
    this.node = h("div", { class: "stage" }, this.frame, this.bar, this.tracks);
  }

  /** Show scenes [{url, name, sample?}] in slots 0, 1, ... in place of what was shown. */
  async open(scenes) {
    put(this.message, h("p", { class: "waiting" }, "Setting up the scene…"));
    try {
      await this.ready();
      await this.fetch(scenes);
      put(this.message);
    } catch (error) {
      if (this.signal.aborted) return;
      put(this.message, error.message === "webgl" ? withoutWebGL() : trouble(inWords(error)));
    }
  }

  async ready() {
    if (this.viewer) return;
    const { createViewer } = await import("/static/viewer/viewer.js");
    if (this.signal.aborted) return;
    this.viewer = await createViewer(this.canvas);
    this.signal.addEventListener("abort", () => this.close());
    if (!this.controls) return;
    this.viewer.addEventListener("time", () => this.tick());
    put(this.bar, stageControls(this.viewer));
  }

  async fetch(scenes) {
    const packs = await Promise.all(scenes.map(({ url }) => bytes(url, this.signal)));
    for (let slot = 0; slot < (this.scenes?.length ?? 0); slot += 1) this.viewer.unload(slot);
    this.scenes = scenes;
    for (const [slot, pack] of packs.entries()) {
      await this.viewer.load(pack, { slot, sample: scenes[slot].sample });
    }
    if (this.signal.aborted) return;
    await this.drawTracks();
    await this.showFilm();
    this.label();
    this.mark(this.points);
    this.dispatchEvent(new Event("opened"));
  }

  async drawTracks() {
    this.timelines.forEach((one) => one.dispose());
    this.timelines = [];
    put(this.tracks);
    const { createTimeline } = await import("/static/viewer/timeline.js");
    for (const slot of this.scenes.keys()) {
      const header = this.viewer.header(slot);
      if (!this.controls || header.frames < 2 || this.scenes[slot].plain) continue;
      this.timelines.push(this.track(createTimeline, slot));
    }
  }

  track(createTimeline, slot) {
    const { name, sample } = this.scenes[slot];
    const host = h("div", { class: "stage-track" });
    this.tracks.append(this.scenes.length > 1 ? h("p", { class: "hint" }, name) : "", host);
    const timeline = createTimeline(host, this.viewer.pack(slot), { sample });
    timeline.addEventListener("seek", (event) => this.viewer.seek(event.detail.time));
    return timeline;
  }

  tick() {
    for (const timeline of this.timelines) timeline.time = this.viewer.time;
    if (this.film) this.film.time = this.viewer.time;
  }

  /** What the phone filmed, in a corner, where one recording is shown. */
  async showFilm() {
    this.film?.dispose();
    const { createFilm } = await import("/static/viewer/film.js");
    this.film = this.scenes.length === 1 ? createFilm(this.viewer.pack(0)) : null;
    put(this.picture, this.film?.element);
    if (this.film) this.film.time = this.viewer.time;
  }

  /** Names over the panes of a comparison. */
  label() {
    if (this.scenes.length < 2) {
      put(this.names);
      return;
    }
    put(
      this.names,
      this.viewer
        .panes()
        .map(({ slot, x, y, width }) =>
          h(
            "span",
            { style: { left: `${x}px`, top: `${y}px`, width: `${width}px` } },
            this.scenes[slot]?.name ?? "",
          ),
        ),
    );
  }

  /** Balls at points of the first scene's object; kept for the next scene. */
  mark(points) {
    this.points = points;
    if (this.viewer?.header(0)) this.viewer.mark(0, points);
  }

  /** Whether a click on the picture is but the end of a drag that turned the view. */
  dragged({ offsetX, offsetY }) {
    return Math.hypot(offsetX - this.down[0], offsetY - this.down[1]) > 4;
  }

  /** Whose the clicks on the picture are: of one part at a time. */
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
