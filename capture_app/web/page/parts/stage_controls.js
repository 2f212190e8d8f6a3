// Buttons and choices of the 3D view.
import { action, box, h, put, say, svg } from "../core/dom.js";
import { LAYERS, camerasOf } from "/static/viewer/words.js";
/** @import {Child} from "../core/dom.js"
 *  @import {Viewer} from "/static/viewer/viewer.js" */

const SPEEDS = [["0.1", "0.1×"], ["0.25", "0.25×"], ["0.5", "0.5×"], ["1", "1×"], ["2", "2×"]];
// What a space is for in them is another thing; of a radio button that is chosen it is nothing.
const OWN_KEYS = "input:not([type=radio], [type=checkbox]), select, textarea, dialog *";
const OWN_SPACE = "input:not([type=radio]:checked), select, textarea, button, summary, dialog *";

/** Everything about playing and looking: a list of nodes. The keys work while the picture is on the screen.
 *  @param {Viewer} viewer @param {HTMLElement} stage what fills the screen @param {AbortSignal} signal */
export function stageControls(viewer, stage, signal) {
  const whole = () => toggleWhole(stage);
  /** @type {Record<string, () => void>} */
  const keys = {
    " ": () => toggle(viewer),
    ",": () => viewer.step(-1),
    ".": () => viewer.step(1),
    "[": () => loopFrom(viewer),
    "]": () => loopTo(viewer),
    "\\": () => (viewer.stretch = null),
    f: whole,
  };
  listen(viewer, stage, keys, signal);
  return [
    play(viewer),
    sign("‹", "A frame back", ",", keys),
    clock(viewer),
    sign("›", "A frame on", ".", keys),
    speed(viewer),
    camera(viewer),
    loop(viewer, keys),
    layers(viewer),
    sign(corners(), "Full screen", "f", keys),
  ];
}

/** The sign of a picture that fills the screen. */
function corners() {
  const path = svg("path", { d: "M1 5V1h4M11 1h4v4M15 11v4h-4M5 15H1v-4" });
  return svg("svg", { viewBox: "0 0 16 16", width: 16, height: 16, "aria-hidden": "true" }, path);
}

/** A button with a sign, which has a key, too.
 *  @param {Child} text @param {string} name @param {string} key @param {Record<string, () => void>} keys */
function sign(text, name, key, keys) {
  const told = { "aria-label": name, "aria-keyshortcuts": key, title: `${name} (${key})` };
  return h("button", { type: "button", class: "sign", ...told, on: { click: keys[key] } }, text);
}

/** A browser that fills the screen with films alone fills the window. @param {HTMLElement} stage */
function toggleWhole(stage) {
  if (document.fullscreenElement) document.exitFullscreen();
  else if (stage.requestFullscreen) stage.requestFullscreen();
  else stage.classList.toggle("whole");
}

/** @param {Viewer} viewer */
function toggle(viewer) {
  if (viewer.playing) viewer.pause();
  else viewer.play();
}

/** @param {Viewer} viewer */
function loopFrom(viewer) {
  const end = viewer.stretch?.[1] ?? viewer.duration;
  viewer.stretch = [viewer.time, end > viewer.time ? end : viewer.duration];
}

/** @param {Viewer} viewer */
function loopTo(viewer) {
  const start = viewer.stretch?.[0] ?? 0;
  viewer.stretch = [start < viewer.time ? start : 0, viewer.time];
}

/** @param {Viewer} viewer */
function play(viewer) {
  const button = h("button", { type: "button", class: "main play" }, "Play");
  const show = () => say(button, viewer.playing ? "Pause" : "Play");
  button.addEventListener("click", () => toggle(viewer));
  for (const event of ["play", "pause", "loaded"]) viewer.addEventListener(event, show);
  return button;
}

/** @param {Viewer} viewer @param {HTMLElement} stage @param {Record<string, () => void>} keys
 *  @param {AbortSignal} signal */
function listen(viewer, stage, keys, signal) {
  /** @param {KeyboardEvent} event */
  const strike = (event) => {
    const act = keys[event.key];
    if (!act || event.defaultPrevented) return;
    if (event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    const own = event.key === " " ? OWN_SPACE : OWN_KEYS;
    if (event.target instanceof Element && event.target.matches(own)) return;
    const { top, bottom } = stage.getBoundingClientRect();
    if (bottom < 0 || top > innerHeight || viewer.duration === 0) return;
    event.preventDefault();
    act();
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
  const { node, input } = select("Camera", [], viewer.cameraMode, change);
  const show = () => {
    put(input, ...options(camerasOf(viewer.header(0))));
    input.value = viewer.cameraMode;
  };
  for (const event of ["camera", "loaded"]) viewer.addEventListener(event, show);
  return node;
}

/** Buttons for the stretch that is played over and over.
 *  @param {Viewer} viewer @param {Record<string, () => void>} keys */
function loop(viewer, keys) {
  const summary = h("summary", {}, "Loop");
  /** @param {string} words @param {string} key */
  const choice = (words, key) =>
    h("button", { type: "button", "aria-keyshortcuts": key, on: { click: keys[key] } }, `${words} (${key})`);
  const show = () => {
    const ends = viewer.stretch?.map((time) => time.toFixed(1)).join(" to ");
    say(summary, ends ? `Loop ${ends} s` : "Loop");
  };
  viewer.addEventListener("stretch", show);
  const choices = [choice("From here", "["), choice("To here", "]"), choice("The whole motion", "\\")];
  return menu(summary, choices);
}

/** @param {string[][]} choices */
function options(choices) {
  return choices.map(([key, words]) => h("option", { value: key }, words));
}

/** @param {string} label @param {string[][]} choices @param {string} value
 *  @param {(value: string) => void} changed */
function select(label, choices, value, changed) {
  const input = h("select", { on: { change: () => changed(input.value) } }, options(choices));
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
  const reset = action("quiet", () => viewer.frameAll(), "Show all of it");
  return menu(h("summary", {}, "Show"), [boxes, reset]);
}

/** @param {HTMLElement} summary @param {Child} choices */
function menu(summary, choices) {
  const node = h("details", { class: "layers" }, summary, box("sheet", choices));
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
