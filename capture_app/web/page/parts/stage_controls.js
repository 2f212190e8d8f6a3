// Buttons and choices of the 3D view.
import { h, say } from "../core/dom.js";
/** @import {Viewer} from "/static/viewer/viewer.js" */

const CAMERAS = [
  ["orbit", "Free"],
  ["follow", "Follow the person"],
  ["object", "On the object"],
  ["phone", "The phone's eye"],
  ["top", "From above"],
];
const SPEEDS = [
  ["0.1", "0.1×"],
  ["0.25", "0.25×"],
  ["0.5", "0.5×"],
  ["1", "1×"],
  ["2", "2×"],
];
const LAYERS = [
  ["body", "Person"],
  ["object", "Object"],
  ["contacts", "Contacts"],
  ["phone", "Phone"],
  ["path", "Phone's path"],
  ["trail", "Trail"],
  ["grid", "Floor"],
  ["shadow", "Shadow"],
];

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
  const { node, input } = select("Camera", CAMERAS, viewer.cameraMode, change);
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
  const boxes = LAYERS.map(([key, words]) => {
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
