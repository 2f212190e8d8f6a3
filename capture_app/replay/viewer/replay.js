// The replay page: the viewer, its timeline, and what stands around them.

import { element } from "./elements.js";
import { createFilm } from "./film.js";
import { readPack } from "./pack.js";
import * as panels from "./panels.js";
import { readScenes } from "./scenes.js";
import { createTimeline } from "./timeline.js";
import { createViewer } from "./viewer.js";
import { sampleName } from "./words.js";
/** @import {Pack, Segment} from "./pack.js"
 *  @import {Placed} from "./reports.js"
 *  @import {Viewer} from "./viewer.js" */

const CLICK = 4; // pixels that a click may wander

/** An element of replay.html, which has it. @param {string} id */
function at(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no ${id}`);
  return found;
}

/** @template {HTMLElement} E @param {string} id @param {new () => E} kind */
function ofKind(id, kind) {
  const found = at(id);
  if (!(found instanceof kind)) throw new Error(`${id} is not a ${kind.name}`);
  return found;
}

/** @param {string} id */
const select = (id) => ofKind(id, HTMLSelectElement);

/** Hears what the viewer or the timeline tells.
 *  @template T @param {EventTarget} source @param {string} kind @param {(told: T) => void} act */
function hear(source, kind, act) {
  source.addEventListener(kind, (event) => event instanceof CustomEvent && act(event.detail));
}

class Page {
  /** @param {Viewer} viewer that shows the first scene @param {Pack} pack of that scene
   *  @param {ArrayBuffer[]} scenes */
  constructor(viewer, pack, scenes) {
    this.viewer = viewer;
    this.scenes = scenes;
    this.header = pack.header;
    this.film = createFilm(pack);
    this.timeline = createTimeline(at("timeline"), pack);
    this.other = "";
  }

  async open() {
    at("film").hidden = !this.film;
    if (this.film) at("film").prepend(this.film.element);
    this.#name();
    this.#timeline();
    panels.cameraButtons(at("cameras"), this.viewer, this.header);
    panels.layerBoxes(at("layers"), this.viewer, this.header);
    panels.speedChoice(select("speed"), this.viewer);
    this.#report(this.header.first);
    this.#choices();
    this.#transport();
    this.#editing();
    hear(this.viewer, "time", (/** @type {{time: number}} */ told) => this.#show(told.time));
    window.addEventListener("resize", () => this.#names());
    document.addEventListener("keydown", (event) => this.#key(event));
    this.#show(0);
    if (this.scenes.length > 1) await this.#compare("scene:1");
    const way = this.header.kind === "session" ? "orbit" : "follow";
    this.viewer.camera(way);
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.viewer.play();
  }

  /** @param {number} sample */
  #report(sample) {
    panels.reportPanel(at("report"), this.header, sample, (event) => this.#go(event));
  }

  #name() {
    const { name, kind, samples, frames, fps, object, report } = this.header;
    document.title = `${name} · replay`;
    at("name").textContent = name;
    const length = `${(Math.max(0, frames - 1) / fps).toFixed(1)} s`;
    const what = samples ? `${samples} sample${samples > 1 ? "s" : ""}` : kind;
    const facts = [what, length, object?.name, report?.app].filter(Boolean);
    at("about").textContent = facts.join(" · ");
  }

  #timeline() {
    /** @param {{time: number}} told */
    const sought = ({ time }) => {
      this.viewer.pause();
      this.viewer.seek(time);
    };
    /** @param {{event: Placed}} told */
    const chosen = ({ event }) => panels.markItem(at("report"), event);
    hear(this.timeline, "seek", sought);
    hear(this.timeline, "event", chosen);
  }

  /** @param {number} time */
  #show(time) {
    this.timeline.time = time;
    if (this.film) this.film.time = time;
  }

  /** @param {Placed} event */
  #go(event) {
    this.viewer.pause();
    this.viewer.seek(event.start / this.header.fps);
    panels.markItem(at("report"), event);
  }

  #choices() {
    const { samples, first } = this.header;
    const names = Array.from({ length: samples }, (_, k) => sampleName(this.header, k));
    const [sample, compare, arrange] = ["sample", "compare", "arrange"].map(select);
    fill(sample, names.map((text, k) => [String(k), text]));
    sample.value = String(first);
    at("sample-label").hidden = samples < 2;
    sample.addEventListener("change", () => this.#pickSample(Number(sample.value)));
    const others = this.scenes.slice(1).map((_, k) => [`scene:${k + 1}`, `scene ${k + 2}`]);
    const own = samples > 1 ? names.map((text, k) => [`sample:${k}`, text]) : [];
    fill(compare, [["", "nothing"], ...others, ...own]);
    at("compare-label").hidden = !others.length && !own.length;
    compare.addEventListener("change", () => this.#compare(compare.value));
    arrange.addEventListener("change", () => {
      this.viewer.arrange(arrange.value);
      this.#names();
    });
  }

  /** @param {number} k */
  #pickSample(k) {
    this.viewer.sample(0, k);
    this.timeline.sample = k;
    this.#report(k);
    this.#names();
  }

  /** "" for nothing, "scene:1" for another scene, "sample:2" for another sample of this one.
   *  @param {string} what */
  async #compare(what) {
    const [kind, number] = what.split(":");
    if (!what) this.viewer.unload(1);
    else if (kind === "sample") {
      await this.viewer.load(this.scenes[0], { slot: 1, sample: Number(number) });
    } else await this.viewer.load(this.scenes[Number(number)], { slot: 1 });
    const header = this.viewer.header(1);
    const sample = header && kind === "sample";
    this.other = sample ? sampleName(header, Number(number)) : (header?.name ?? "");
    const compare = select("compare");
    compare.value = what;
    if (kind === "scene") compare.selectedOptions[0].textContent = this.other;
    at("arrange-label").hidden = !what;
    this.viewer.frameAll();
    this.#names();
  }

  #names() {
    const same = this.other.startsWith("Sample");
    const shown = Number(select("sample").value);
    const first = same ? sampleName(this.header, shown) : this.header.name;
    const names = this.viewer.header(1) ? [first, this.other] : [];
    panels.paneNames(at("panes"), this.viewer, names);
    at("panes").hidden = !names.length;
  }

  #transport() {
    const play = at("play");
    const mark = () => {
      play.textContent = this.viewer.playing ? "\u275a\u275a" : "\u25b6";
      play.setAttribute("aria-label", this.viewer.playing ? "Pause" : "Play");
    };
    play.addEventListener("click", () => this.#toggle());
    const loop = ofKind("loop", HTMLInputElement);
    loop.addEventListener("change", () => (this.viewer.loop = loop.checked));
    this.viewer.addEventListener("play", mark);
    this.viewer.addEventListener("pause", mark);
  }

  #toggle() {
    if (this.viewer.playing) this.viewer.pause();
    else this.viewer.play();
  }

  #editing() {
    const { timeline, viewer } = this;
    at("edit").hidden = !this.header.editable;
    at("edit").addEventListener("click", () => this.#edit(!timeline.editable));
    at("save").addEventListener("click", () => this.#save());
    /** @param {{segments: Segment[]}} told */
    const edited = ({ segments }) => viewer.contacts(0, segments);
    hear(timeline, "edit", edited);
    timeline.addEventListener("select", () => this.#hint());
    const canvas = at("view");
    /** @type {number[] | null} */
    let from = null;
    canvas.addEventListener("pointerdown", ({ clientX, clientY }) => (from = [clientX, clientY]));
    canvas.addEventListener("pointerup", (event) => {
      const [x, y] = from ?? [event.clientX, event.clientY];
      const wandered = Math.hypot(event.clientX - x, event.clientY - y);
      if (timeline.editable && timeline.selected && wandered <= CLICK) this.#hold(event);
    });
  }

  /** @param {boolean} wanted */
  #edit(wanted) {
    this.timeline.editable = wanted;
    at("edit").setAttribute("aria-pressed", String(wanted));
    at("save").hidden = !wanted;
    this.#hint();
  }

  #hint() {
    const { editable, selected } = this.timeline;
    const hand = selected?.hand;
    at("view").classList.toggle("picking", editable && Boolean(selected));
    at("hint").textContent = !editable
      ? ""
      : selected
        ? `Click on the object where the ${hand} hand shall hold it.`
        : "Choose a contact, or add one.";
  }

  /** @param {PointerEvent} event */
  #hold({ clientX, clientY }) {
    const { left, top } = at("view").getBoundingClientRect();
    const found = this.viewer.pick(clientX - left, clientY - top);
    if (found?.slot === 0) this.timeline.setAnchor(found);
  }

  #save() {
    const text = `${JSON.stringify(this.timeline.contacts, null, 2)}\n`;
    const place = URL.createObjectURL(new Blob([text], { type: "application/json" }));
    element("a", { href: place, download: "contacts.json" }).click();
    URL.revokeObjectURL(place);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (this.timeline.undoKey(event) || event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target instanceof Element ? event.target : document.body;
    if (target.matches("input, select, textarea")) return;
    /** @param {number} frames */
    const step = (frames) => () => this.viewer.step(frames);
    /** @type {Record<string, () => void>} */
    const acts = {
      ArrowLeft: step(-1),
      ArrowRight: step(1),
      ",": step(-1),
      ".": step(1),
      Home: step(-Infinity),
      End: step(Infinity),
    };
    if (event.key === " " && !target.matches("button, summary")) acts[" "] = () => this.#toggle();
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }
}

/** @param {HTMLSelectElement} into @param {string[][]} options */
function fill(into, options) {
  into.replaceChildren(...options.map(([value, text]) => element("option", { value, text })));
}

async function start() {
  try {
    const scenes = await readScenes();
    if (!scenes.length) throw new Error("This page shows no scene.");
    const viewer = await createViewer(ofKind("view", HTMLCanvasElement));
    await viewer.load(scenes[0], { slot: 0 });
    const page = new Page(viewer, readPack(scenes[0]), scenes);
    await page.open();
    at("wait").textContent = "";
    Object.assign(window, { replay: page });
  } catch (problem) {
    const message = problem instanceof Error ? problem.message : String(problem);
    at("wait").textContent =
      message === "webgl"
        ? "This browser draws no 3D (WebGL 2). Use another one, or switch on its graphics acceleration."
        : `The scene cannot be shown. ${message}`;
  }
}

start();
