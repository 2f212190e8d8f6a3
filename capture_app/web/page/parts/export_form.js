// The motion for another program.
import { api } from "../core/api.js";
import { h, put, say } from "../core/dom.js";
import { announce } from "../core/live.js";
import { poll } from "../core/poll.js";
import { ended } from "../core/words.js";
import { attempt, choice } from "./fields.js";
import { fileList } from "./files.js";
import { trouble } from "./trouble.js";
/** @import {Choices, Job, Result} from "../core/answers.js" */

/** Where what happens is told, and what follows a file. @typedef {{status: HTMLElement,
 *    problem: HTMLElement, signal: AbortSignal, made: () => Promise<void>}} Telling */

/** @type {Record<string, string>} */
const FORMATS = {
  glb: "GLB: Blender, Unity, Unreal",
  bvh: "BVH: any animation program",
  usd: "USD: Maya, Houdini, Unreal",
  fbx: "FBX: through your Blender",
  amass: "npz: SMPL-X, for research",
  csv: "CSV: for spreadsheets",
};
/** @type {Record<string, string>} */
const BONES = { smplx: "SMPL-X", mixamo: "Mixamo", unreal: "Unreal", unity: "Unity", vrm: "VRM" };

/** Format and its few options, the job, and the file when it is there. `made()` after each file.
 *  `sample()`: which one the file is of, from 1.
 *  @param {Result} item @param {Choices} choices
 *  @param {{sample: () => number, signal: AbortSignal, made: () => Promise<void>}} more */
export function exportForm(item, choices, { sample, signal, made }) {
  const to = choice(
    "Format",
    choices.exports.map(({ to: key }) => [key, FORMATS[key] ?? key]),
  );
  const bones = choice(
    "Names of the bones",
    choices.bones.map((key) => [key, BONES[key] ?? key]),
  );
  const fps = choice(
    "Frames a second",
    choices.fps.map((rate) => [String(rate), String(rate)]),
    { value: "30" },
  );
  const up = choice("Up axis", [["", "as usual there"]]);
  const axes = () => {
    const ups = choices.exports.find((one) => one.to === to.read())?.ups ?? [];
    put(
      up.input,
      h("option", { value: "" }, "as usual there"),
      ups.length > 1 && ups.map((axis) => h("option", { value: axis }, axis)),
    );
  };
  to.input.addEventListener("change", axes);
  axes();
  const status = h("p", { class: "hint", role: "status" });
  const problem = h("div");
  const button = h("button", { type: "submit", class: "main" }, "Make the file");
  const order = () => ({
    kind: "export",
    result: item.id,
    to: to.read(),
    bones: bones.read(),
    fps: Number(fps.read()),
    up: up.read() || null,
    sample: sample(),
  });
  return h(
    "form",
    {
      class: "stack",
      on: {
        submit: (event) => {
          event.preventDefault();
          attempt(button, problem, () => carryOut(order(), { status, problem, signal, made }));
        },
      },
    },
    to.node,
    h(
      "details",
      {},
      h("summary", {}, "Options"),
      h("div", { class: "grid" }, bones.node, fps.node, up.node),
    ),
    h("div", { class: "row" }, button),
    status,
    problem,
  );
}

/** @param {object} order @param {Telling} telling */
async function carryOut(order, { status, problem, signal, made }) {
  put(status, "Writing…");
  const { id } = await api("/api/jobs", { json: order, signal });
  let job = /** @type {Job | null} */ (null);
  /** @param {unknown} error */
  const failed = (error) => {
    throw error;
  };
  const look = async () => {
    /** @type {Job} */
    const now = await api(`/api/jobs/${id}`, { signal });
    job = now;
    return ended(now);
  };
  await poll(look, 400, signal, failed);
  if (signal.aborted || !job) return;
  say(status, "");
  if (job.state !== "done") {
    put(problem, trouble(job.error ?? { what: "The export was cancelled." }));
    return;
  }
  put(status, "Here it is: ", fileList(job.files ?? []));
  announce("The file is written.");
  await made();
}
