// The timeline of a scene: a scrubber, and under it what happens when. docs/replay.md tells how to use it.

import { clock, element } from "./elements.js";
import { lanesOf } from "./lanes.js";
import { reportLane } from "./reports.js";
import { Strips } from "./strips.js";
import { tickSeconds } from "./ticks.js";
/** @import {Pack, Segment} from "./pack.js"
 *  @import {Picked} from "./pick.js"
 *  @import {Placed} from "./reports.js" */

/** @typedef {{sample?: number, editable?: boolean}} Options */
/** A word or number beside a lane that follows the playhead.
 *  @typedef {{told: HTMLElement, at: (frame: number) => string}} Readout */

/** @param {Element} host @param {Pack} pack @param {Options} options */
export function createTimeline(host, pack, options = {}) {
  return new Timeline(host, pack, options);
}

export class Timeline extends EventTarget {
  #pack;
  #root;
  #rows;
  #scrubber = element("div");
  #tools;
  /** @type {HTMLButtonElement[]} */
  #buttons = [];
  #status;
  /** @type {Strips | null} */
  #strips = null;
  /** @type {Readout[]} */
  #readouts = [];
  #sample;
  #time = 0;

  /** @param {Element} host @param {Pack} pack @param {Options} options */
  constructor(host, pack, { sample = pack.header.first, editable = false }) {
    super();
    this.#pack = pack;
    this.#sample = sample;
    this.#status = element("p", { class: "tl-status", role: "status" });
    this.#rows = element("div", { class: "tl-rows" });
    this.#tools = element("div", { class: "tl-tools", role: "group", "aria-label": "Correct the contacts" });
    this.#root = element("div", { class: "tl" }, [this.#rows, this.#tools, this.#status]);
    host.append(this.#root);
    if (pack.header.samples) {
      const frame = () => this.#frame();
      this.#strips = new Strips(pack, sample, (kind, detail) => this.#hear(kind, detail), frame);
      this.#makeTools(this.#strips);
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

  /** What is played over and over, seconds; null for the whole. @param {number[] | null} seconds */
  set stretch(seconds) {
    const { fps, frames } = this.#pack.header;
    const [start, end] = seconds ?? [0, 0];
    this.#rows.style.setProperty("--from", String((start * fps) / frames));
    this.#rows.style.setProperty("--to", String(seconds ? (end * fps + 1) / frames : 0));
  }

  /** The same scene with another motion; what has the focus keeps it. @param {Pack} pack */
  set pack(pack) {
    const { activeElement: active } = document;
    const scrubbed = active === this.#scrubber;
    this.#pack = pack;
    this.#build();
    if (scrubbed) this.#scrubber.focus({ preventScroll: true });
    else if (active instanceof HTMLElement && this.#root.contains(active)) active.focus({ preventScroll: true });
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

  /** What a pick on the object gave ({anchor, point_object, normal_object}), a place of the palm, or null.
   *  @param {Picked | number[] | null} at */
  setAnchor(at) {
    const { selected } = this;
    if (!selected) return;
    const held = Array.isArray(at) ? { anchor: at } : at && heldAt(at);
    this.#strips?.edit((edits) => edits.hold(selected, held));
  }

  /** Let a contact hold elsewhere, `instead` of where the last edit put it, while it is dragged.
   *  @param {Segment} segment @param {Picked} at @param {boolean} instead */
  move(segment, at, instead) {
    if (instead) this.#strips?.edits.takeBack();
    this.#strips?.edit((edits) => edits.hold(segment, heldAt(at)));
  }

  /** The contact of a hand at the playhead. @param {string} hand */
  heldBy(hand) {
    const frame = this.#frame();
    return this.segments.find((s) => s.hand === hand && s.start <= frame && frame < s.stop) ?? null;
  }

  /** All contacts as they are now, the corrected ones with the places that were picked. */
  get segments() {
    return this.#strips?.edits.segments ?? [];
  }

  /** Corrections of earlier, in place of the contacts as they are. @param {Segment[]} segments */
  restore(segments) {
    this.#strips?.edit((edits) => edits.restore(segments));
  }

  undo() {
    this.#strips?.edit((edits) => edits.undo());
  }

  redo() {
    this.#strips?.edit((edits) => edits.redo());
  }

  /** Ctrl-Z takes an edit back, Ctrl-Y or Ctrl-Shift-Z makes it again; whether it was one of these.
   *  @param {KeyboardEvent} event */
  undoKey(event) {
    const { target } = event;
    if (!this.editable || event.altKey || !(event.ctrlKey || event.metaKey)) return false;
    if (target instanceof Element && target.matches("input, select, textarea")) return false;
    const key = event.key.toLowerCase();
    if (key !== "z" && key !== "y") return false;
    event.preventDefault();
    if (key === "z" && !event.shiftKey) this.undo();
    else this.redo();
    return true;
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
    for (const { name, lane, at } of lanesOf(this.#pack, this.#sample)) this.#row(name, lane, at);
    const reports = reportLane(this.#pack.header, this.#sample, (event) => this.#choose(event));
    if (reports) this.#row("Report", reports);
    for (const mark of ["tl-stretch", "tl-playhead"]) {
      this.#rows.append(element("div", { class: mark, "aria-hidden": "true" }));
    }
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
    for (const second of tickSeconds(this.#duration)) {
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

  /** @param {string} name @param {HTMLElement} lane @param {Readout["at"] | null} at */
  #row(name, lane, at = null) {
    const told = element("output", { class: "tl-now" });
    if (at) this.#readouts.push({ told, at });
    const label = element("div", { class: "tl-label" }, [element("span", { text: name }), told]);
    this.#rows.append(element("div", { class: "tl-row" }, [label, lane]));
  }

  /** @param {Strips} strips */
  #makeTools(strips) {
    /** @type {(text: string, onclick: () => void) => HTMLButtonElement} */
    const tool = (text, onclick) => element("button", { type: "button", class: "tl-tool", text, onclick });
    this.#buttons = [
      tool("Delete", () => strips.remove()),
      tool("Undo", () => this.undo()),
      tool("Reset", () => this.reset()),
    ];
    this.#tools.append(
      tool("Add left", () => this.#add(strips, "left")),
      tool("Add right", () => this.#add(strips, "right")),
      ...this.#buttons,
    );
  }

  /** @param {Strips} strips @param {string} hand */
  #add(strips, hand) {
    const count = strips.edits.segments.length;
    strips.add(hand);
    const added = strips.edits.segments.length > count;
    this.#status.textContent = added
      ? ""
      : `The ${hand} hand has no room for another contact at ${clock(this.#time)}.`;
  }

  #enable() {
    if (!this.#strips) return;
    const [remove, undo, reset] = this.#buttons;
    remove.disabled = !this.selected;
    undo.disabled = !this.#strips.edits.past.length;
    reset.disabled = !this.dirty;
  }

  /** @param {Placed} event */
  #choose(event) {
    this.#seek(event.start);
    this.#tell("event", { event });
  }

  /** Anywhere on the lanes but on a thing of its own. @param {PointerEvent} event */
  #press(event) {
    const { target } = event;
    const lane = target instanceof Element && target.closest(".tl-lane, .tl-scrubber");
    if (!lane || event.button !== 0 || target.closest("button, .tl-end")) return;
    event.preventDefault();
    this.#scrubber.focus({ preventScroll: true });
    const off = new AbortController();
    /** @type {number | null} */
    let from = null;
    /** @param {PointerEvent} now */
    const scrub = ({ clientX }) => {
      const { left, width } = lane.getBoundingClientRect();
      this.#seek(Math.floor(((clientX - left) / width) * this.#pack.header.frames));
      from ??= this.#time;
      const ends = [from, this.#time].sort((a, b) => a - b);
      if (event.shiftKey) this.#tell("stretch", { stretch: ends });
    };
    scrub(event);
    window.addEventListener("pointermove", scrub, { signal: off.signal });
    window.addEventListener("pointerup", () => off.abort(), { signal: off.signal });
    window.addEventListener("pointercancel", () => off.abort(), { signal: off.signal });
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const { target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (target instanceof Element && target.matches("input, select")) return;
    const frame = this.#frame();
    const second = Math.round(this.#pack.header.fps);
    const on = target === this.#scrubber;
    /** @type {Record<string, number>} */
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

  /** @param {number} frame */
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

  /** What the strips tell. @param {string} kind @param {object} detail */
  #hear(kind, detail) {
    if (kind === "follow" && "frame" in detail) this.#seek(Number(detail.frame));
    else this.#tell(kind, detail);
  }

  /** @param {string} kind @param {object} detail */
  #tell(kind, detail) {
    this.#enable();
    this.dispatchEvent(new CustomEvent(kind, { detail }));
  }
}

/** @param {Picked} picked */
function heldAt({ anchor, point_object: place, normal_object: normal }) {
  return { anchor, place, normal };
}
