// The contact strips: one lane a hand, a bar for each contact, edited with the mouse or keys.

import { ContactEdits, HANDS } from "./contact_edits.js";
import { element } from "./elements.js";

const PAGE = 10;
const STEPS = {
  ArrowLeft: -1,
  ArrowRight: 1,
  ArrowDown: -1,
  ArrowUp: 1,
  PageDown: -PAGE,
  PageUp: PAGE,
};

export class Strips {
  // tell(kind, detail) hears "edit" and "select"; frame() is that of the playhead.
  constructor(pack, sample, tell, frame) {
    this.header = pack.header;
    this.tell = tell;
    this.frame = frame;
    this.editable = false;
    this.selected = null;
    this.bars = new Map();
    this.lanes = HANDS.map((hand) => ({
      hand,
      label: `${hand === "left" ? "Left" : "Right"} hand`,
      lane: element("div", { class: "tl-lane tl-contacts", role: "group" }),
    }));
    this.show(sample);
  }

  show(sample) {
    const { contacts, frames, fps } = this.header;
    this.edits = new ContactEdits(contacts[sample] ?? [], frames, fps);
    this.select(null);
    this.draw();
  }

  setEditable(editable) {
    this.editable = editable;
    this.draw();
  }

  select(segment) {
    if (segment === this.selected) return;
    this.selected = segment;
    this.#press();
    this.tell("select", { segment });
  }

  // `act` changes the edits and returns the segment to select.
  edit(act) {
    const before = this.edits.segments;
    const segment = act(this.edits) ?? null;
    this.select(segment);
    if (this.edits.segments === before) return;
    this.draw();
    this.tell("edit", { contacts: this.edits.file(), segments: this.edits.segments });
  }

  add(hand) {
    this.edit((edits) => edits.add(hand, this.frame()));
    this.bars.get(this.selected)?.whole.focus();
  }

  remove() {
    if (!this.selected) return;
    const { hand } = this.selected;
    this.edit((edits) => edits.remove(this.selected));
    const next = this.edits.segments.find((s) => s.hand === hand);
    this.bars.get(next)?.whole.focus();
  }

  draw() {
    this.bars.clear();
    for (const { hand, label, lane } of this.lanes) {
      const own = this.edits.segments.filter((s) => s.hand === hand);
      lane.setAttribute("aria-label", `${label}: ${own.length} contact${own.length === 1 ? "" : "s"}`);
      lane.replaceChildren(...own.map((segment, k) => this.#bar(segment, `${label} contact ${k + 1}`)));
    }
  }

  #bar(segment, name) {
    const at = (frame) => `${(100 * frame) / this.header.frames}%`;
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
    const parts = { whole };
    if (this.editable) {
      for (const part of ["start", "stop"]) {
        parts[part] = this.#end(segment, part, name);
        bar.append(parts[part]);
      }
    }
    for (const [part, handle] of Object.entries(parts)) this.#listen(handle, segment, part);
    this.bars.set(segment, parts);
    return bar;
  }

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

  #listen(handle, segment, part) {
    handle.addEventListener("focus", () => this.select(segment));
    handle.addEventListener("click", () => this.select(segment));
    if (!this.editable) return;
    handle.addEventListener("pointerdown", (event) => this.#drag(event, segment, part));
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

  #move(segment, part, by) {
    this.edit((edits) => edits.moved(segment, part, by));
    this.bars.get(this.selected)?.[part].focus();
  }

  #press() {
    if (!this.editable) return;
    for (const [segment, { whole }] of this.bars) {
      whole.setAttribute("aria-pressed", String(segment === this.selected));
    }
  }

  // One drag is one step of undo.
  #drag(event, segment, part) {
    if (event.button !== 0) return;
    event.preventDefault();
    this.select(segment);
    const lane = event.currentTarget.closest(".tl-lane");
    const width = lane.getBoundingClientRect().width;
    const from = event.clientX;
    let current = segment;
    let done = 0;
    const off = new AbortController();
    const move = (now) => {
      const by = Math.round(((now.clientX - from) / width) * this.header.frames);
      if (by === done) return;
      if (current !== segment) this.edits.undo();
      done = by;
      this.edit((edits) => (current = edits.moved(segment, part, by)));
      if (current === segment) this.#redraw();
    };
    const end = () => {
      off.abort();
      this.bars.get(current)?.[part].focus();
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
