// Mouse, fingers and keys on the picture.

/** @import {Camera} from "./camera.js" */

const TURN = 0.0055; // radians a pixel
const KEY_TURN = 0.08;
const STEP = 1.12;

/** Where each finger is, by its pointer's id. @typedef {Map<number, [number, number]>} Fingers */

/** Calls camera.turn, move and closer, then `changed`; returns what takes the listeners away.
 *  @param {HTMLCanvasElement} canvas @param {Camera} camera @param {() => void} changed */
export function control(canvas, camera, changed) {
  /** @type {Fingers} */
  const fingers = new Map();
  const off = new AbortController();
  const signal = off.signal;

  // Where the style leaves touches to the page, one finger scrolls it, and the wheel until the picture
  // has the focus.
  const scrolls = () => getComputedStyle(canvas).touchAction !== "none";

  /** @param {PointerEvent} event */
  const press = (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  };
  /** @param {PointerEvent} event */
  const lift = (event) => fingers.delete(event.pointerId);
  /** @param {PointerEvent} event */
  const drag = (event) => {
    if (!fingers.has(event.pointerId)) return;
    const before = spread(fingers);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    const after = spread(fingers);
    const dx = after.x - before.x;
    const dy = after.y - before.y;
    const shared = event.pointerType === "touch" && scrolls();
    if (shared && fingers.size < 2) return;
    const moving = (fingers.size > 1 && !shared) || event.shiftKey || (event.buttons & 6) > 0;
    if (moving) camera.move(dx / canvas.clientHeight, dy / canvas.clientHeight);
    else camera.turn(dx * TURN, dy * TURN);
    if (fingers.size > 1 && after.size > 0) camera.closer(before.size / after.size);
    changed();
  };
  /** Two fingers do not scroll. @param {TouchEvent} event */
  const touch = (event) => {
    if (event.touches.length > 1 && event.cancelable) event.preventDefault();
  };
  /** @param {WheelEvent} event */
  const roll = (event) => {
    if (scrolls() && document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    camera.closer(Math.exp(Math.min(Math.max(event.deltaY, -120), 120) * 0.0015));
    changed();
  };
  /** @param {KeyboardEvent} event */
  const strike = (event) => {
    const act = KEYS[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    act(camera, event.shiftKey);
    event.preventDefault();
    event.stopPropagation();
    changed();
  };
  canvas.addEventListener("pointerdown", press, { signal });
  canvas.addEventListener("pointerup", lift, { signal });
  canvas.addEventListener("pointercancel", lift, { signal });
  canvas.addEventListener("pointermove", drag, { signal });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
  canvas.addEventListener("wheel", roll, { signal, passive: false });
  canvas.addEventListener("touchstart", touch, { signal, passive: false });
  canvas.addEventListener("touchmove", touch, { signal, passive: false });
  canvas.addEventListener("keydown", strike, { signal });
  return () => off.abort();
}

/** @typedef {(camera: Camera, moving: boolean) => void} Act */

/** @type {(x: number, y: number) => Act} */
const arrow = (x, y) => (camera, moving) =>
  moving ? camera.move(-0.05 * x, -0.05 * y) : camera.turn(KEY_TURN * x, KEY_TURN * y);

/** @type {Record<string, Act>} */
const KEYS = {
  ArrowLeft: arrow(1, 0),
  ArrowRight: arrow(-1, 0),
  ArrowUp: arrow(0, 1),
  ArrowDown: arrow(0, -1),
  "+": (camera) => camera.closer(1 / STEP),
  "=": (camera) => camera.closer(1 / STEP),
  "-": (camera) => camera.closer(STEP),
};

/** Middle of the fingers, and how far two of them are apart. @param {Fingers} fingers */
function spread(fingers) {
  const points = [...fingers.values()];
  const x = points.reduce((sum, p) => sum + p[0], 0) / points.length;
  const y = points.reduce((sum, p) => sum + p[1], 0) / points.length;
  const size = points.length > 1 ? Math.hypot(points[0][0] - points[1][0], points[0][1] - points[1][1]) : 0;
  return { x, y, size };
}
