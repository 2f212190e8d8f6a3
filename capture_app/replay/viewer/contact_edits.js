// Contacts of one sample that are being edited: segments of each hand that keep their distance.

/** @import {Held, Segment} from "./pack.js" */

export const HANDS = ["left", "right"];
const TRAVEL = 3; // frames that a hand needs between two places
const NEW_LENGTH = 15;
const DECIMALS = 1e5;

export class ContactEdits {
  /** @param {Segment[]} segments @param {number} frames @param {number} fps */
  constructor(segments, frames, fps) {
    this.frames = frames;
    this.fps = fps;
    this.own = sorted(segments.map((segment) => ({ ...segment })));
    this.segments = this.own;
    /** @type {Segment[][]} */
    this.past = [];
    /** @type {Segment[][]} */
    this.undone = [];
  }

  get dirty() {
    return JSON.stringify(this.file()) !== JSON.stringify(this.#laidOut(this.own));
  }

  // What contacts.json holds, as omomo_core/contact/contact_file.py lays it out.
  file() {
    return this.#laidOut(this.segments);
  }

  /** Room of a segment: the frames between its neighbours of the same hand.
   *  @param {Segment} segment */
  room(segment) {
    const others = this.segments.filter((s) => s.hand === segment.hand && s !== segment);
    const before = others.filter((s) => s.start < segment.start).map((s) => s.stop + TRAVEL);
    const after = others.filter((s) => s.start > segment.start).map((s) => s.start - TRAVEL);
    return { low: Math.max(0, ...before), high: Math.min(this.frames, ...after) };
  }

  /** Moves one end, or the whole (`part` "start", "stop" or "whole"), by some frames.
   *  @param {Segment} segment @param {string} part @param {number} by */
  moved(segment, part, by) {
    const { low, high } = this.room(segment);
    const { start, stop } = segment;
    const length = stop - start;
    if (part === "start") return this.#put(segment, { start: clamp(start + by, low, stop - 1) });
    if (part === "stop") return this.#put(segment, { stop: clamp(stop + by, start + 1, high) });
    const first = clamp(start + by, low, Math.max(low, high - length));
    return this.#put(segment, { start: first, stop: first + length });
  }

  /** A new segment at a frame, as long as there is room; null where there is none.
   *  @param {string} hand @param {number} frame */
  add(hand, frame) {
    /** @type {Segment} */
    const segment = { hand, start: frame, stop: frame + 1 };
    const { low, high } = this.room(segment);
    const taken = this.segments.some(
      (s) => s.hand === hand && s.start - TRAVEL <= frame && frame < s.stop + TRAVEL,
    );
    if (taken || frame < low || frame >= high) return null;
    segment.stop = Math.min(frame + NEW_LENGTH, high);
    this.#keep();
    this.segments = sorted([...this.segments, segment]);
    return segment;
  }

  /** @param {Segment} segment */
  remove(segment) {
    this.#keep();
    this.segments = this.segments.filter((s) => s !== segment);
  }

  /** The place that a hand holds, {anchor, place, normal} in the object's frame; null: the nearest.
   *  @param {Segment} segment @param {Partial<Held> | null} at */
  hold(segment, at) {
    const { anchor, place, normal, ...rest } = segment;
    return this.#replace(segment, at ? { ...rest, ...at } : rest);
  }

  undo() {
    const before = this.past.pop();
    if (!before) return;
    this.undone.push(this.segments);
    this.segments = before;
  }

  /** Forget the last edit: a drag is going on. */
  takeBack() {
    this.segments = this.past.pop() ?? this.segments;
  }

  redo() {
    const after = this.undone.pop();
    if (!after) return;
    this.past.push(this.segments);
    this.segments = after;
  }

  /** @param {Segment[]} segments */
  restore(segments) {
    this.#keep();
    this.segments = sorted(segments.map((segment) => ({ ...segment })));
  }

  reset() {
    this.#keep();
    this.segments = this.own;
  }

  /** @param {Segment} segment @param {{start?: number, stop?: number}} change */
  #put(segment, change) {
    const { start, stop } = { ...segment, ...change };
    const same = start === segment.start && stop === segment.stop;
    return same ? segment : this.#replace(segment, { ...segment, start, stop });
  }

  /** @param {Segment} segment @param {Segment} changed */
  #replace(segment, changed) {
    this.#keep();
    this.segments = sorted(this.segments.map((s) => (s === segment ? changed : s)));
    return changed;
  }

  #keep() {
    this.past.push(this.segments);
    this.undone = [];
  }

  /** @param {Segment[]} segments */
  #laidOut(segments) {
    /** @param {number[]} p */
    const rounded = (p) => p.map((value) => Math.round(value * DECIMALS) / DECIMALS);
    return {
      version: 1,
      fps: this.fps,
      frames: this.frames,
      segments: segments.map(({ hand, start, stop, anchor }) => ({
        hand,
        start,
        stop,
        ...(anchor ? { anchor: rounded(anchor) } : {}),
      })),
    };
  }
}

/** @param {number} value @param {number} low @param {number} high */
function clamp(value, low, high) {
  return Math.min(Math.max(value, low), high);
}

/** @param {Segment[]} segments */
function sorted(segments) {
  return [...segments].sort((a, b) => a.start - b.start || HANDS.indexOf(a.hand) - HANDS.indexOf(b.hand));
}
