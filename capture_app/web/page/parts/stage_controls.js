// Buttons and choices of the 3D view.
import { h, say } from "../core/dom.js";
import { CAMERAS, LAYERS } from "/static/viewer/words.js";
/** @import {Viewer} from "/static/viewer/viewer.js" */

const SPEEDS = [
  ["0.1", "0.1×"],
  ["0.25", "0.25×"],
  ["0.5", "0.5×"],
  ["1", "1×"],
  ["2", "2×"],
];
// What a space is for in them is another thing; of a radio button that is chosen it is nothing.
const OWN_SPACE = "input:not([type=radio]:checked), select, textarea, button, summary, dialog *";

/** Play, clock, speed, camera and layers for a viewer: a list of nodes. @param {Viewer} viewer */
export function stageControls(viewer) {
  return [play(viewer), clock(viewer), speed(viewer), camera(viewer), layers(viewer)];
}

/** @param {Viewer} viewer */
function play(viewer) {
  const button = h("button", { type: "button", class: "main play" }, "Play");
  const show = () => say(button, viewer.playing ? "Pause" : "Play");
  button.addEventListener("click", () => (viewer.playing ? viewer.pause() : viewer.play(), show()));
  for (const event of ["play", "pause", "loaded"]) viewer.addEventListener(event, show);
  return button;
}

/** The space bar plays and pauses while the picture is on the screen.
 *  @param {Viewer} viewer @param {HTMLElement} picture @param {AbortSignal} signal */
export function playBySpace(viewer, picture, signal) {
  /** @param {KeyboardEvent} event */
  const strike = (event) => {
    if (event.key !== " " || event.defaultPrevented) return;
    if (event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    if (event.target instanceof Element && event.target.matches(OWN_SPACE)) return;
    const { top, bottom } = picture.getBoundingClientRect();
    if (bottom < 0 || top > innerHeight || viewer.duration === 0) return;
    event.preventDefault();
    if (viewer.playing) viewer.pause();
    else viewer.play();
  };
  document.addEventListener("keydown", strike, { signal });
}

/** @param {Viewer} viewer */
function clock(viewer) {
  const node = h("span", { class: "clock figures" });
  const show = () => say(node, `${viewer.time.toFixed(1)} / ${viewer.duration.toFixed(1)} s`);
  for (const event of ["time", "loaded"]) viewer.addEventListener(event, show);
  show();
  return node;
}

/** @param {Viewer} viewer */
function speed(viewer) {
  return select("Speed", SPEEDS, "1", (value) => (viewer.speed = Number(value))).node;
}

/** @param {Viewer} viewer */
function camera(viewer) {
  const change = (/** @type {string} */ mode) => viewer.camera(mode);
  const { node, input } = select("Camera", Object.entries(CAMERAS), viewer.cameraMode, change);
  viewer.addEventListener("camera", () => (input.value = viewer.cameraMode));
  return node;
}

/** @param {string} label @param {string[][]} options @param {string} value
 *  @param {(value: string) => void} changed */
function select(label, options, value, changed) {
  const input = h(
    "select",
    { on: { change: () => changed(input.value) } },
    options.map(([key, words]) => h("option", { value: key }, words)),
  );
  input.value = value;
  return { node: h("label", { class: "inline" }, h("span", {}, label), input), input };
}

/** @param {Viewer} viewer */
function layers(viewer) {
  const boxes = Object.entries(LAYERS).map(([key, words]) => {
    const input = h("input", { type: "checkbox", checked: viewer.layers[key] });
    input.addEventListener("change", () => viewer.show({ [key]: input.checked }));
    return h("label", { class: "tick" }, input, h("span", {}, words));
  });
  const reset = h(
    "button",
    { type: "button", class: "quiet", on: { click: () => viewer.frameAll() } },
    "Show all of it",
  );
  const sheet = h("div", { class: "sheet" }, boxes, reset);
  const node = h("details", { class: "layers" }, h("summary", {}, "Show"), sheet);
  closesByItself(node);
  return node;
}

/** As a menu does: by Escape, and by a click beside it. @param {HTMLDetailsElement} details */
function closesByItself(details) {
  /** @param {PointerEvent} event */
  const beside = ({ target }) => {
    if (!(target instanceof Node && details.contains(target))) details.open = false;
  };
  details.addEventListener("toggle", () => {
    if (details.open) document.addEventListener("pointerdown", beside);
    else document.removeEventListener("pointerdown", beside);
  });
  details.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    details.open = false;
    details.querySelector("summary")?.focus();
  });
}
