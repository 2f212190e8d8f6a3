// The timeline of a scene: a scrubber, and under it what happens when. docs/replay.md tells how to use it.

import { bandLane, curveLane } from "./curves.js";
import { clock, element } from "./elements.js";
import { Motion } from "./motion.js";
import { reportLane } from "./reports.js";
import { Strips } from "./strips.js";

const TRACKING = ["good", "limited", "lost"];
const TICKS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600];
const MOST_TICKS = 12;
const FULL_MISS = 0.05; // metres that fill the lane of misses at least
const FULL_SPEED = 0.5; // m/s

export function createTimeline(host, pack, options = {}) {
  return new Timeline(host, pack, options);
}

class Timeline extends EventTarget {
  #pack;
  #root;
  #rows;
  #scrubber;
  #status;
  #tools;
  #strips = null;
  #readouts = [];
  #sample;
  #time = 0;

  constructor(host, pack, { sample = pack.header.chosen, editable = false }) {
    super();
    this.#pack = pack;
    this.#sample = sample;
    this.#status = element("p", { class: "tl-status", role: "status" });
    this.#rows = element("div", { class: "tl-rows" });
    this.#tools = element("div", { class: "tl-tools", role: "group", "aria-label": "Edit contacts" });
    this.#root = element("div", { class: "tl" }, [this.#rows, this.#tools, this.#status]);
    host.append(this.#root);
    if (pack.header.samples) {
      const frame = () => this.#frame();
      this.#strips = new Strips(pack, sample, (kind, detail) => this.#tell(kind, detail), frame);
      this.#makeTools();
    }
    this.#build();
    this.#rows.addEventListener("pointerdown", (event) => this.#press(event));
    this.#root.addEventListener("keydown", (event) => this.#key(event));
    this.editable = editable;
  }

  get time() {
    return this.#time;
  }

  set time(seconds) {
    const frame = this.#frame();
    this.#time = Math.min(Math.max(seconds, 0), this.#duration);
    const share = (this.#time * this.#pack.header.fps + 0.5) / this.#pack.header.frames;
    this.#rows.style.setProperty("--at", share.toFixed(5));
    if (frame !== this.#frame()) this.#read();
  }

  get sample() {
    return this.#sample;
  }

  set sample(k) {
    this.#sample = k;
    this.#strips?.show(k);
    this.#build();
  }

  get editable() {
    return this.#strips?.editable ?? false;
  }

  set editable(wanted) {
    this.#strips?.setEditable(Boolean(wanted) && this.#pack.header.editable);
    this.#tools.hidden = !this.editable;
    this.#enable();
  }

  get contacts() {
    return this.#strips?.edits.file() ?? null;
  }

  get dirty() {
    return this.#strips?.edits.dirty ?? false;
  }

  get selected() {
    return this.#strips?.selected ?? null;
  }

  // What a pick on the object gave ({anchor, point_object, normal_object}), a place of the palm, or null.
  setAnchor(at) {
    if (!this.selected) return;
    const held = Array.isArray(at) ? { anchor: at } : at && heldAt(at);
    this.#strips.edit((edits) => edits.hold(this.selected, held));
  }

  undo() {
    this.#strips?.edit((edits) => edits.undo());
  }

  reset() {
    this.#strips?.edit((edits) => edits.reset());
  }

  dispose() {
    this.#root.remove();
  }

  get #duration() {
    return Math.max(0, this.#pack.header.frames - 1) / this.#pack.header.fps;
  }

  #frame() {
    return Math.round(this.#time * this.#pack.header.fps);
  }

  #build() {
    this.#readouts = [];
    this.#rows.replaceChildren(this.#head());
    for (const { label, lane } of this.#strips?.lanes ?? []) this.#row(label, lane);
    this.#curves();
    const reports = reportLane(this.#pack.header, (event) => this.#choose(event));
    if (reports) this.#row("Report", reports);
    this.#rows.append(element("div", { class: "tl-playhead", "aria-hidden": "true" }));
    this.#read();
  }

  #head() {
    const { fps, frames } = this.#pack.header;
    this.#scrubber = element("div", {
      class: "tl-scrubber",
      role: "slider",
      tabindex: "0",
      "aria-label": "Time",
      "aria-valuemin": "0",
      "aria-valuemax": String(frames - 1),
    });
    const step = TICKS.find((size) => this.#duration / size <= MOST_TICKS) ?? 1200;
    for (let second = 0; second <= this.#duration; second += step) {
      const text = `${Number(second.toFixed(1))}${second ? "" : " s"}`;
      const tick = element("span", { class: "tl-tick", text, "aria-hidden": "true" });
      tick.style.left = `${(100 * (second * fps + 0.5)) / frames}%`;
      this.#scrubber.append(tick);
    }
    const told = element("output", { class: "tl-now" });
    this.#readouts.push({ told, at: (frame) => clock(frame / fps) });
    const label = element("div", { class: "tl-label" }, [element("span", { text: "Time" }), told]);
    return element("div", { class: "tl-row tl-head" }, [label, this.#scrubber]);
  }

  #row(name, lane, at = null) {
    const told = element("output", { class: "tl-now" });
    if (at) this.#readouts.push({ told, at });
    const label = element("div", { class: "tl-label" }, [element("span", { text: name }), told]);
    this.#rows.append(element("div", { class: "tl-row" }, [label, lane]));
  }

  #curves() {
    const motion = new Motion(this.#pack);
    motion.sample = this.#sample;
    if (this.#pack.array("palm_miss")) {
      const [left, right] = [0, 1].map((hand) => motion.series("palm_miss", 2, hand));
      const values = left.map((value, f) => Math.max(value, right[f]));
      const about = { top: FULL_MISS, unit: "cm" };
      this.#curve("Palm off", { ...about, values, kind: "tl-one", label: "Palm off its place" });
      const inside = motion.series("inside");
      this.#curve("Inside", { ...about, values: inside, kind: "tl-two", label: "Body in the object" });
    }
    const states = this.#pack.array("tracking");
    if (!states) return;
    const band = bandLane({ states, names: TRACKING, label: tracked(states) });
    this.#row("Tracking", band.lane, band.at);
    const values = this.#pack.array("phone_speed");
    const label = "Speed of the phone";
    this.#curve("Speed", { values, top: FULL_SPEED, unit: "m/s", label, kind: "tl-one" });
  }

  #curve(name, about) {
    const { lane, at } = curveLane(about);
    this.#row(name, lane, at);
  }

  #makeTools() {
    const add = (hand) => () => this.#add(hand);
    const tool = (text, onclick) => element("button", { type: "button", class: "tl-tool", text, onclick });
    this.#tools.append(
      tool("Add left", add("left")),
      tool("Add right", add("right")),
      tool("Delete", () => this.#strips.remove()),
      tool("Undo", () => this.undo()),
      tool("Reset", () => this.reset()),
    );
  }

  #add(hand) {
    const count = this.#strips.edits.segments.length;
    this.#strips.add(hand);
    const added = this.#strips.edits.segments.length > count;
    this.#status.textContent = added
      ? ""
      : `The ${hand} hand has no room for another contact at ${clock(this.#time)}.`;
  }

  #enable() {
    if (!this.#strips) return;
    const [, , remove, undo, reset] = this.#tools.children;
    remove.disabled = !this.selected;
    undo.disabled = !this.#strips.edits.past.length;
    reset.disabled = !this.dirty;
  }

  #choose(event) {
    this.#seek(event.start);
    this.#tell("event", { event });
  }

  // Anywhere on the lanes but on a thing of its own.
  #press(event) {
    const lane = event.target.closest(".tl-lane, .tl-scrubber");
    if (!lane || event.button !== 0 || event.target.closest("button, .tl-end")) return;
    event.preventDefault();
    this.#scrubber.focus({ preventScroll: true });
    const off = new AbortController();
    const scrub = ({ clientX }) => {
      const { left, width } = lane.getBoundingClientRect();
      this.#seek(Math.floor(((clientX - left) / width) * this.#pack.header.frames));
    };
    scrub(event);
    window.addEventListener("pointermove", scrub, { signal: off.signal });
    for (const kind of ["pointerup", "pointercancel"]) {
      window.addEventListener(kind, () => off.abort(), { signal: off.signal });
    }
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select")) return;
    const frame = this.#frame();
    const second = Math.round(this.#pack.header.fps);
    const on = event.target === this.#scrubber;
    const places = {
      ",": frame - 1,
      ".": frame + 1,
      ...(on && {
        ArrowLeft: frame - 1,
        ArrowDown: frame - 1,
        ArrowRight: frame + 1,
        ArrowUp: frame + 1,
        PageDown: frame - second,
        PageUp: frame + second,
        Home: 0,
        End: this.#pack.header.frames - 1,
      }),
    };
    if (!(event.key in places)) return;
    event.preventDefault();
    event.stopPropagation();
    this.#seek(places[event.key]);
  }

  #seek(frame) {
    const { fps, frames } = this.#pack.header;
    this.time = Math.min(Math.max(frame, 0), frames - 1) / fps;
    this.#tell("seek", { time: this.#time });
  }

  #read() {
    const frame = this.#frame();
    for (const { told, at } of this.#readouts) told.textContent = at(frame);
    this.#scrubber.setAttribute("aria-valuenow", String(frame));
    const whole = clock(this.#duration);
    this.#scrubber.setAttribute("aria-valuetext", `${clock(this.#time)} of ${whole}`);
  }

  #tell(kind, detail) {
    this.#enable();
    this.dispatchEvent(new CustomEvent(kind, { detail }));
  }
}

function heldAt({ anchor, point_object: place, normal_object: normal }) {
  return { anchor, place, normal };
}

function tracked(states) {
  const good = states.filter((state) => state === 0).length / states.length;
  return `Tracking is good in ${Math.round(100 * good)} % of the take`;
}
