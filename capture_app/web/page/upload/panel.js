// An upload as it is seen: how far, how long still, pause, cancel, and what went wrong.
import { inWords } from "../core/api.js";
import { action, announce, h, inRow, put, say } from "../core/dom.js";
import { count, size, span } from "../core/words.js";
import { attempt } from "../parts/fields.js";
import { trouble } from "../parts/trouble.js";
/** @import {Upload} from "./send.js" */

/** @type {Record<string, string>} */
const KIND = { session: "Recording", object: "Object", mount: "Mount", video: "Film", material: "Files" };
/** @type {[string, number][]} */
const UNITS = [["metres", 1], ["centimetres", 0.01], ["millimetres", 0.001], ["inches", 0.0254]];

/** A card for an Upload; it goes on living while the upload does. `gone` is called when cancelled.
 *  @param {Upload} upload */
export function uploadPanel(upload, gone = () => {}) {
  const bar = h("progress", { max: 1000, value: 0, "aria-label": `Upload of ${upload.order.name}` });
  const line = h("p", { class: "hint figures" });
  const problem = h("div");
  const pause = h("button", { type: "button", class: "quiet" });
  const cancel = h("button", { type: "button", class: "quiet" }, "Cancel");
  const buttons = inRow(pause, cancel);
  const node = h(
    "section",
    { class: "card upload", "aria-label": `Upload: ${upload.order.name}` },
    h("h2", { class: "small" }, `${KIND[upload.order.kind]}: ${upload.order.name}`),
    bar,
    line,
    problem,
    buttons,
  );
  pause.addEventListener("click", () =>
    upload.state === "sending" || upload.state === "waiting" ? upload.pause() : upload.start(),
  );
  cancel.addEventListener("click", () =>
    attempt(cancel, problem, () => upload.cancel()).then(() => {
      if (upload.state === "cancelled") gone();
    }),
  );
  const show = () => {
    bar.value = 1000 * (upload.size ? upload.received / upload.size : 1);
    say(line, words(upload));
    say(pause, upload.state === "failed" ? "Try again" : upload.state === "paused" ? "Go on" : "Pause");
    buttons.hidden = ["finishing", "done"].includes(upload.state);
    told(upload, problem);
  };
  upload.addEventListener("change", show);
  show();
  return node;
}

/** @param {Upload} upload */
function words(upload) {
  const { state, received, size: whole } = upload;
  const far = `${size(received)} of ${size(whole)}`;
  const left = upload.secondsLeft;
  const time = left !== null && left < 1e6 ? ` · ${size(upload.rate)}/s · about ${span(Math.max(left, 1))} left` : "";
  return {
    starting: `${count(upload.order.files.length, "file")}, ${size(whole)}`,
    sending: `${far}${time}`,
    waiting: `${far} · The line is lost. It goes on by itself as soon as omocap answers.`,
    paused: `${far} · paused`,
    finishing: `${size(whole)} arrived. Looking at it…`,
    done: `${size(whole)} arrived.`,
    failed: far,
    cancelled: "Cancelled.",
  }[state];
}

/** @param {Upload} upload @param {HTMLElement} problem */
function told(upload, problem) {
  if (problem.dataset.state === upload.state) return;
  problem.dataset.state = upload.state;
  put(problem);
  const { error } = upload;
  if (error && upload.state === "failed") put(problem, trouble(error, ...unitButtons(upload)));
  if (["waiting", "paused", "done"].includes(upload.state)) announce(words(upload));
}

/** A mesh in another unit than metres: one click says which. @param {Upload} upload */
function unitButtons(upload) {
  if (upload.error?.code !== "mesh-units") return [];
  return UNITS.slice(1).map(([unit, scale]) => action("", () => again(upload, scale), `It is in ${unit}`));
}

/** @param {Upload} upload @param {number} scale */
async function again(upload, scale) {
  upload.stop = new AbortController();
  try {
    await upload.finish({ scale });
  } catch (error) {
    upload.error = inWords(error);
    upload.become("failed");
  }
}
