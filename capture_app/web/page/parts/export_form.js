// The motion for another program.
import { ApiError, api, bytes } from "../core/api.js";
import { announce, box, folded, h, inRow, put, say } from "../core/dom.js";
import { poll } from "../core/poll.js";
import { ended } from "../core/words.js";
import { broughtAs } from "./brought.js";
import { describedFields, grid, saidIn, sends } from "./fields.js";
import { fileList } from "./files.js";
import { trouble } from "./trouble.js";
/** @import {Choices, Item, Job, Made, Result} from "../core/answers.js" @import {Stage} from "./stage.js" */

/** Where what happens is told, and what follows a file. @typedef {{status: HTMLElement,
 *    problem: HTMLElement, signal: AbortSignal, stage: Stage, made: () => Promise<void>}} Telling */

/** Format and its few options, the job, and the file when it is there. `made()` after each file.
 *  A character that is brought is written as GLB at once, and shown on the stage from that file.
 *  `sample()`: which one the file is of, from 1.
 *  @param {Result} item @param {Choices} choices @param {Item[]} materials
 *  @param {{sample: () => number, signal: AbortSignal, stage: Stage, made: () => Promise<void>}} more */
export function exportForm(item, choices, materials, { sample, signal, stage, made }) {
  /** @param {string} id of the character */
  const changed = (id) => id && to.read() === "glb" && form.requestSubmit();
  const character = choices.forms.export.filter(({ kind }) => kind === "brought");
  const own = character.map((one) => [one.name, broughtAs(one, materials, signal, { changed })]);
  const { to, skeleton, ...more } = describedFields(choices.forms.export, Object.fromEntries(own));
  // A format that has an axis or a unit by definition leaves no choice of another one.
  const narrow = () => {
    const { ups = [], units = [] } = choices.exports.find((one) => one.to === to.read()) ?? {};
    for (const [input, allowed] of /** @type {[any, string[]][]} */ ([
      [more.up.input, ups],
      [more.units.input, units],
    ])) {
      for (const option of input.options) option.disabled = option.value !== "" && !allowed.includes(option.value);
      if (input.selectedOptions[0].disabled) input.value = "";
    }
  };
  to.input.addEventListener("change", narrow);
  narrow();
  const status = h("div", { class: "stack hint", role: "status" });
  const problem = h("div");
  const button = h("button", { type: "submit", class: "main" }, "Make the file");
  const order = () => ({ kind: "export", result: item.id, ...saidIn({ to, skeleton, ...more }), sample: sample() });
  const form = h(
    "form",
    { class: "stack", ...sends(button, problem, () => carryOut(order(), { status, problem, signal, stage, made })) },
    to.node,
    folded("Options", grid(more), skeleton.node),
    inRow(button),
    status,
    problem,
  );
  return form;
}

/** @param {{sample: number, to?: string, skeleton?: string}} order @param {Telling} telling */
async function carryOut(order, { status, problem, signal, stage, made }) {
  put(status, "Writing…");
  const { id } = await api("/api/jobs", { json: order, signal });
  let job = /** @type {Job | null} */ (null);
  const look = async () => {
    job = /** @type {Job} */ (await api(`/api/jobs/${id}`, { signal }));
    return ended(job);
  };
  await poll(look, 400, signal, (error) => {
    throw error;
  });
  if (signal.aborted || !job) return;
  say(status, "");
  if (job.state !== "done") {
    put(problem, trouble(job.error ?? { what: "The export was cancelled." }));
    return;
  }
  const notes = job.summary.notes ?? [];
  const warned = notes.length > 0 && box("note", notes.map((note) => h("p", {}, note)));
  put(status, "Here it is: ", fileList(job.files ?? []), warned);
  announce("The file is written.");
  await made();
  const [file] = job.files ?? [];
  if (order.skeleton && order.to === "glb" && file) await show(file, order.sample, { status, stage, signal });
}

/** Show the very file that can be downloaded. @param {Made} file @param {number} number of the sample, from 1
 *  @param {Pick<Telling, "status" | "stage" | "signal">} telling */
async function show(file, number, { status, stage, signal }) {
  const hint = h("p", { class: "waiting" }, "Loading it into the 3D view…");
  status.append(hint);
  try {
    const glb = await bytes(file.href, signal);
    await stage.showCharacter(glb, number - 1).catch((error) => {
      throw new ApiError(0, { code: "character", what: error.message, fix: "The file itself holds the motion: open it elsewhere." });
    });
  } catch (error) {
    hint.remove();
    throw error;
  }
  hint.classList.remove("waiting");
  say(hint, "The 3D view shows this file. “Person” under the view changes back to our body.");
}
