// The replay page: the viewer, its timeline, and what stands around them.

import { element } from "./elements.js";
import { createFilm } from "./film.js";
import * as panels from "./panels.js";
import { readScenes } from "./scenes.js";
import { createTimeline } from "./timeline.js";
import { createViewer } from "./viewer.js";

const CLICK = 4; // pixels that a click may wander
const at = (id) => document.getElementById(id);

class Page {
  constructor(viewer, scenes) {
    this.viewer = viewer;
    this.scenes = scenes;
  }

  async open() {
    await this.viewer.load(this.scenes[0], { slot: 0 });
    this.header = this.viewer.header(0);
    this.film = createFilm(this.viewer.pack(0));
    at("film").hidden = !this.film;
    if (this.film) at("film").prepend(this.film.element);
    this.#name();
    this.#timeline();
    panels.cameraButtons(at("cameras"), this.viewer, this.header);
    panels.layerBoxes(at("layers"), this.viewer, this.header);
    panels.speedChoice(at("speed"), this.viewer);
    panels.reportPanel(at("report"), this.header, (event) => this.#go(event));
    this.#choices();
    this.#transport();
    this.#editing();
    this.viewer.addEventListener("time", ({ detail }) => this.#show(detail.time));
    window.addEventListener("resize", () => this.#names());
    document.addEventListener("keydown", (event) => this.#key(event));
    this.#show(0);
    if (this.scenes.length > 1) await this.#compare("scene:1");
    const way = this.header.kind === "session" ? "orbit" : "follow";
    this.viewer.camera(way);
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.viewer.play();
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
    this.timeline = createTimeline(at("timeline"), this.viewer.pack(0));
    this.timeline.addEventListener("seek", ({ detail }) => {
      this.viewer.pause();
      this.viewer.seek(detail.time);
    });
    this.timeline.addEventListener("event", ({ detail }) =>
      panels.markItem(at("report"), detail.event),
    );
  }

  #show(time) {
    this.timeline.time = time;
    if (this.film) this.film.time = time;
  }

  #go(event) {
    this.viewer.pause();
    this.viewer.seek(event.start / this.header.fps);
    panels.markItem(at("report"), event);
  }

  #choices() {
    const { samples, chosen } = this.header;
    const names = Array.from({ length: samples }, (_, k) => panels.sampleName(this.header, k));
    fill(at("sample"), names.map((text, k) => [String(k), text]));
    at("sample").value = String(chosen);
    at("sample-label").hidden = samples < 2;
    at("sample").addEventListener("change", () => this.#pickSample(Number(at("sample").value)));
    const others = this.scenes.slice(1).map((_, k) => [`scene:${k + 1}`, `scene ${k + 2}`]);
    const own = samples > 1 ? names.map((text, k) => [`sample:${k}`, text]) : [];
    fill(at("compare"), [["", "nothing"], ...others, ...own]);
    at("compare-label").hidden = !others.length && !own.length;
    at("compare").addEventListener("change", () => this.#compare(at("compare").value));
    at("arrange").addEventListener("change", () => {
      this.viewer.arrange(at("arrange").value);
      this.#names();
    });
  }

  #pickSample(k) {
    this.viewer.sample(0, k);
    this.timeline.sample = k;
    this.#names();
  }

  // "" for nothing, "scene:1" for another scene, "sample:2" for another sample of this one.
  async #compare(what) {
    const [kind, number] = what.split(":");
    if (!what) this.viewer.unload(1);
    else if (kind === "sample") {
      await this.viewer.load(this.scenes[0], { slot: 1, sample: Number(number) });
    } else await this.viewer.load(this.scenes[Number(number)], { slot: 1 });
    const header = this.viewer.header(1);
    this.other = header && (kind === "sample" ? panels.sampleName(header, Number(number)) : header.name);
    if (kind === "scene") at("compare").querySelector(`[value="${what}"]`).textContent = this.other;
    at("compare").value = what;
    at("arrange-label").hidden = !what;
    this.viewer.frameAll();
    this.#names();
  }

  #names() {
    const same = this.other?.startsWith("Sample");
    const first = same ? panels.sampleName(this.header, Number(at("sample").value)) : this.header.name;
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
    at("loop").addEventListener("change", () => (this.viewer.loop = at("loop").checked));
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
    timeline.addEventListener("edit", ({ detail }) => viewer.contacts(0, detail.segments));
    timeline.addEventListener("select", () => this.#hint());
    const canvas = at("view");
    let from = null;
    canvas.addEventListener("pointerdown", ({ clientX, clientY }) => (from = [clientX, clientY]));
    canvas.addEventListener("pointerup", (event) => {
      const wandered = from && Math.hypot(event.clientX - from[0], event.clientY - from[1]);
      if (timeline.editable && timeline.selected && wandered <= CLICK) this.#hold(event);
    });
  }

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

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches("input, select, textarea")) return;
    const step = (frames) => () => {
      this.viewer.pause();
      this.viewer.seek(this.viewer.time + frames / this.header.fps);
    };
    const acts = {
      ArrowLeft: step(-1),
      ArrowRight: step(1),
      ",": step(-1),
      ".": step(1),
      Home: step(-Infinity),
      End: step(Infinity),
    };
    if (event.key === " " && !event.target.matches("button, summary")) acts[" "] = () => this.#toggle();
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }
}

function fill(select, options) {
  select.replaceChildren(...options.map(([value, text]) => element("option", { value, text })));
}

async function start() {
  try {
    const scenes = await readScenes();
    if (!scenes.length) throw new Error("This page shows no scene.");
    const page = new Page(await createViewer(at("view")), scenes);
    await page.open();
    at("wait").textContent = "";
    window.replay = page;
  } catch (problem) {
    at("wait").textContent =
      problem.message === "webgl"
        ? "This browser draws no 3D (WebGL 2). Use another one, or switch on its graphics acceleration."
        : `The scene cannot be shown. ${problem.message}`;
  }
}

start();
