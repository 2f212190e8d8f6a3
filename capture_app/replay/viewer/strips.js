// The contact strips: one lane a hand, a bar for each contact, edited with the mouse or keys.

import { ContactEdits, HANDS } from "./contact_edits.js";
import { element } from "./elements.js";
/** @import {Pack, Segment} from "./pack.js" */

/** A bar, and its ends while it can be edited.
 *  @typedef {{whole: HTMLElement, start?: HTMLElement, stop?: HTMLElement}} Handles */
/** @typedef {keyof Handles} Part */

const PAGE = 10;
/** @type {("start" | "stop")[]} */
const ENDS = ["start", "stop"];
/** @type {Record<string, number>} */
const STEPS = {
  ArrowLeft: -1,
  ArrowRight: 1,
  ArrowDown: -1,
  ArrowUp: 1,
  PageDown: -PAGE,
  PageUp: PAGE,
};

export class Strips {
  /** tell(kind, detail) hears "edit", "select" and "follow" of a frame; frame() is that of the playhead.
   *  @param {Pack} pack @param {number} sample
   *  @param {(kind: string, detail: object) => void} tell @param {() => number} frame */
  constructor(pack, sample, tell, frame) {
    this.header = pack.header;
    this.tell = tell;
    this.frame = frame;
    this.editable = false;
    /** @type {Segment | null} */
    this.selected = null;
    /** @type {Map<Segment, Handles>} */
    this.bars = new Map();
    this.lanes = HANDS.map((hand) => ({
      hand,
      label: `${hand === "left" ? "Left" : "Right"} hand`,
      lane: element("div", { class: "tl-lane tl-contacts", role: "group" }),
    }));
    this.edits = this.#editsOf(sample);
    this.draw();
  }

  /** @param {number} sample */
  show(sample) {
    this.edits = this.#editsOf(sample);
    this.select(null);
    this.draw();
  }

  /** @param {number} sample */
  #editsOf(sample) {
    const { contacts, frames, fps } = this.header;
    return new ContactEdits(contacts[sample] ?? [], frames, fps);
  }

  /** @param {boolean} editable */
  setEditable(editable) {
    this.editable = editable;
    this.draw();
  }

  /** @param {Segment | null} segment */
  select(segment) {
    if (segment === this.selected) return;
    this.selected = segment;
    this.#press();
    this.tell("select", { segment });
  }

  /** `act` changes the edits and returns the segment to select.
   *  @param {(edits: ContactEdits) => Segment | null | void} act */
  edit(act) {
    const before = this.edits.segments;
    const segment = act(this.edits) ?? null;
    this.select(segment);
    if (this.edits.segments === before) return;
    this.draw();
    this.tell("edit", { contacts: this.edits.file(), segments: this.edits.segments });
  }

  /** @param {string} hand */
  add(hand) {
    this.edit((edits) => edits.add(hand, this.frame()));
    this.#handles(this.selected)?.whole.focus();
  }

  remove() {
    const { selected } = this;
    if (!selected) return;
    this.edit((edits) => {
      edits.remove(selected);
      return null;
    });
    const next = this.edits.segments.find((s) => s.hand === selected.hand);
    this.#handles(next)?.whole.focus();
  }

  draw() {
    this.bars.clear();
    for (const { hand, label, lane } of this.lanes) {
      const own = this.edits.segments.filter((s) => s.hand === hand);
      lane.setAttribute("aria-label", `${label}: ${own.length} contact${own.length === 1 ? "" : "s"}`);
      lane.replaceChildren(...own.map((segment, k) => this.#bar(segment, `${label} contact ${k + 1}`)));
    }
  }

  /** @param {Segment} segment @param {string} name */
  #bar(segment, name) {
    /** @param {number} frame */
    const at = (frame) => `${(100 * frame) / this.header.frames}%`;
    /** @param {number} frame */
    const seconds = (frame) => (frame / this.header.fps).toFixed(2);
    const place = segment.anchor ? "" : ", at the nearest place";
    const whole = element("button", {
      type: "button",
      class: "tl-bar",
      "aria-pressed": this.editable ? String(segment === this.selected) : null,
      "aria-label": `${name}, ${seconds(segment.start)} to ${seconds(segment.stop)} s${place}`,
      title: `${name}: frames ${segment.start} to ${segment.stop}${place}`,
    });
    const bar = element("div", { class: `tl-hold${segment.anchor ? "" : " tl-free"}` }, [whole]);
    bar.style.left = at(segment.start);
    bar.style.width = at(segment.stop - segment.start);
    /** @type {Handles} */
    const parts = { whole };
    this.#listen(whole, segment, "whole");
    for (const part of this.editable ? ENDS : []) {
      const end = this.#end(segment, part, name);
      this.#listen(end, segment, part);
      bar.append(end);
      parts[part] = end;
    }
    this.bars.set(segment, parts);
    return bar;
  }

  /** @param {Segment} segment @param {"start" | "stop"} part @param {string} name */
  #end(segment, part, name) {
    const { low, high } = this.edits.room(segment);
    const value = segment[part];
    return element("div", {
      class: `tl-end tl-${part}`,
      role: "slider",
      tabindex: "0",
      "aria-label": `${name}, ${part}`,
      "aria-valuemin": part === "start" ? low : segment.start + 1,
      "aria-valuemax": part === "start" ? segment.stop - 1 : high,
      "aria-valuenow": value,
      "aria-valuetext": `frame ${value}, ${(value / this.header.fps).toFixed(2)} seconds`,
    });
  }

  /** @param {HTMLElement} handle @param {Segment} segment @param {Part} part */
  #listen(handle, segment, part) {
    handle.addEventListener("focus", () => this.select(segment));
    handle.addEventListener("click", () => this.select(segment));
    if (!this.editable) return;
    handle.addEventListener("pointerdown", (event) => {
      const lane = handle.closest(".tl-lane");
      if (lane) this.#drag(event, lane, segment, part);
    });
    handle.addEventListener("keydown", (event) => {
      if (event.key in STEPS) {
        this.#move(segment, part, STEPS[event.key] * (event.shiftKey ? PAGE : 1));
      } else if (event.key === "Delete" || event.key === "Backspace") {
        this.select(segment);
        this.remove();
      } else return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  /** @param {Segment} segment @param {Part} part @param {number} by */
  #move(segment, part, by) {
    this.edit((edits) => edits.moved(segment, part, by));
    this.#show(this.selected, part);
    this.#handles(this.selected)?.[part]?.focus();
  }

  /** The playhead goes with what is moved. @param {Segment | null} segment @param {Part} part */
  #show(segment, part) {
    if (segment) this.tell("follow", { frame: part === "stop" ? segment.stop - 1 : segment.start });
  }

  /** @param {Segment | null | undefined} segment */
  #handles(segment) {
    return segment ? this.bars.get(segment) : undefined;
  }

  #press() {
    if (!this.editable) return;
    for (const [segment, { whole }] of this.bars) {
      whole.setAttribute("aria-pressed", String(segment === this.selected));
    }
  }

  /** One drag is one step of undo.
   *  @param {PointerEvent} event @param {Element} lane @param {Segment} segment @param {Part} part */
  #drag(event, lane, segment, part) {
    if (event.button !== 0) return;
    event.preventDefault();
    this.select(segment);
    const { width } = lane.getBoundingClientRect();
    const from = event.clientX;
    let current = segment;
    let done = 0;
    const off = new AbortController();
    /** @param {PointerEvent} now */
    const move = (now) => {
      const by = Math.round(((now.clientX - from) / width) * this.header.frames);
      if (by === done) return;
      if (current !== segment) this.edits.takeBack();
      done = by;
      this.edit((edits) => (current = edits.moved(segment, part, by)));
      if (current === segment) this.#redraw();
      this.#show(current, part);
    };
    const end = () => {
      off.abort();
      this.#handles(current)?.[part]?.focus();
    };
    window.addEventListener("pointermove", move, { signal: off.signal });
    window.addEventListener("pointerup", end, { signal: off.signal });
    window.addEventListener("pointercancel", end, { signal: off.signal });
  }

  // A drag that came back to where it began.
  #redraw() {
    this.draw();
    this.tell("edit", { contacts: this.edits.file(), segments: this.edits.segments });
  }
}
