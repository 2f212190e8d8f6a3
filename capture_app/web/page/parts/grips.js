// The hands that hold the object, to be taken in the picture and moved over its surface.
import { announce, h } from "../core/dom.js";
/** @import {Segment} from "/static/viewer/pack.js"
 *  @import {Stage} from "./stage.js" */

const STEP = 6; // CSS pixels by which an arrow key moves a hand; with shift a single one
const REST = 120; // milliseconds without a change of the view
const BEHIND = 0.06; // metres between a place and what is seen there
const SLACK = 3; // CSS pixels that a click may move
/** @type {Record<string, number[]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** Handles on the hands while the motion stands still and `able()`; `moved()` after each move.
 *  @param {Stage} stage @param {() => boolean} able @param {() => void} moved */
export function grips(stage, able, moved) {
  const all = ["left", "right"].map((hand) => new Grip(hand, stage, moved));
  const follow = () => all.forEach((one) => one.follow(able()));
  stage.addEventListener("opened", () => {
    stage.viewer?.removeEventListener("drawn", follow);
    stage.viewer?.addEventListener("drawn", follow);
  });
}

class Grip {
  /** Where the hand holds, in CSS pixels of the picture. */
  at = { x: 0, y: 0 };
  timer = 0;

  /** @param {string} hand @param {Stage} stage @param {() => void} moved */
  constructor(hand, stage, moved) {
    this.hand = hand;
    this.stage = stage;
    this.moved = moved;
    this.handle = h("button", {
      type: "button",
      class: "grip",
      hidden: true,
      title: "Drag it over the object, or move it with the arrow keys",
      "aria-label": `Place of the ${hand} hand on the object; arrow keys move it`,
      on: { pointerdown: (event) => this.drag(event), keydown: (event) => this.step(event) },
    });
    stage.frame.append(this.handle);
  }

  /** The contact of the hand at this moment. */
  get contact() {
    return this.stage.timelines.at(0)?.heldBy(this.hand) ?? null;
  }

  /** @param {boolean} able */
  follow(able) {
    const { viewer, canvas } = this.stage;
    const contact = able && viewer && !viewer.playing ? this.contact : null;
    if (contact && viewer) this.at = viewer.contactAt(contact);
    const { x, y } = this.at;
    this.handle.hidden = !contact || x < 0 || y < 0 || x > canvas.clientWidth || y > canvas.clientHeight;
    Object.assign(this.handle.style, { left: `${x}px`, top: `${y}px` });
    clearTimeout(this.timer);
    if (contact) this.timer = window.setTimeout(() => this.dim(contact), REST);
  }

  /** Show whether the object hides the place. @param {Segment} contact */
  dim({ place, anchor }) {
    const { x, y } = this.at;
    const seen = this.stage.viewer?.pick(x, y)?.point_object;
    const at = place ?? anchor;
    const away = at && seen ? Math.hypot(...at.map((value, k) => value - seen[k])) : 0;
    this.handle.classList.toggle("behind", away > BEHIND);
  }

  /** Whether the object is there. @param {Segment} contact @param {number} x @param {number} y
   *  @param {boolean} instead of where the last edit put it */
  put(contact, x, y, instead) {
    const hit = this.stage.viewer?.pick(x, y);
    if (hit) this.stage.timelines.at(0)?.move(contact, hit, instead);
    return Boolean(hit);
  }

  /** One drag is one step of undo. @param {PointerEvent} event */
  drag(event) {
    const { contact, handle } = this;
    if (event.button !== 0 || !contact) return;
    event.preventDefault();
    handle.focus({ preventScroll: true });
    handle.setPointerCapture(event.pointerId);
    let edited = false;
    const move = (/** @type {PointerEvent} */ now) => {
      const far = Math.hypot(now.clientX - event.clientX, now.clientY - event.clientY) > SLACK;
      const { left, top } = this.stage.canvas.getBoundingClientRect();
      if (far || edited) edited = this.put(contact, now.clientX - left, now.clientY - top, edited) || edited;
    };
    const end = () => {
      handle.removeEventListener("pointermove", move);
      if (edited) this.moved();
    };
    handle.addEventListener("pointermove", move);
    handle.addEventListener("lostpointercapture", end, { once: true });
  }

  /** @param {KeyboardEvent} event */
  step(event) {
    const { contact, at } = this;
    const by = ARROWS[event.key];
    if (!by || !contact || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const [dx, dy] = by.map((one) => one * (event.shiftKey ? 1 : STEP));
    if (this.put(contact, at.x + dx, at.y + dy, false)) this.moved();
    else announce("That is beside the object. Turn the view to go on.");
  }
}
