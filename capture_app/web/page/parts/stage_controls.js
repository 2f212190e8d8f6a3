// Buttons and choices of the 3D view.
import { h, say } from "../core/dom.js";

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

/** Play, clock, speed, camera and layers for a viewer: a list of nodes. */
export function stageControls(viewer) {
  return [play(viewer), clock(viewer), speed(viewer), camera(viewer), layers(viewer)];
}

function play(viewer) {
  const button = h("button", { type: "button", class: "main play" }, "Play");
  const show = () => say(button, viewer.playing ? "Pause" : "Play");
  button.addEventListener("click", () => (viewer.playing ? viewer.pause() : viewer.play(), show()));
  for (const event of ["play", "pause", "loaded"]) viewer.addEventListener(event, show);
  return button;
}

function clock(viewer) {
  const node = h("span", { class: "clock figures" });
  const show = () => say(node, `${viewer.time.toFixed(1)} / ${viewer.duration.toFixed(1)} s`);
  for (const event of ["time", "loaded"]) viewer.addEventListener(event, show);
  show();
  return node;
}

function speed(viewer) {
  return select("Speed", SPEEDS, "1", (value) => (viewer.speed = Number(value)));
}

function camera(viewer) {
  const node = select("Camera", CAMERAS, viewer.cameraMode ?? "orbit", (value) =>
    viewer.camera(value),
  );
  viewer.addEventListener("camera", () => (node.querySelector("select").value = viewer.cameraMode));
  return node;
}

function select(label, options, value, changed) {
  const input = h(
    "select",
    { on: { change: () => changed(input.value) } },
    options.map(([key, words]) => h("option", { value: key }, words)),
  );
  input.value = value;
  return h("label", { class: "inline" }, h("span", {}, label), input);
}

function layers(viewer) {
  const boxes = LAYERS.map(([key, words]) => {
    const input = h("input", { type: "checkbox", checked: viewer.layers?.[key] ?? true });
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

/** As a menu does: by Escape, and by a click beside it. */
function closesByItself(details) {
  const beside = (event) => details.contains(event.target) || (details.open = false);
  details.addEventListener("toggle", () => {
    const change = details.open ? "addEventListener" : "removeEventListener";
    document[change]("pointerdown", beside);
  });
  details.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    details.open = false;
    details.querySelector("summary").focus();
  });
}
