// The motion for another program.
import { api } from "../core/api.js";
import { announce, folded, h, inRow, put, say } from "../core/dom.js";
import { poll } from "../core/poll.js";
import { ended } from "../core/words.js";
import { broughtAs } from "./brought.js";
import { describedFields, grid, saidIn, sends } from "./fields.js";
import { fileList } from "./files.js";
import { trouble } from "./trouble.js";
/** @import {Choices, Item, Job, Result} from "../core/answers.js" */

/** Where what happens is told, and what follows a file. @typedef {{status: HTMLElement,
 *    problem: HTMLElement, signal: AbortSignal, made: () => Promise<void>}} Telling */

/** Format and its few options, the job, and the file when it is there. `made()` after each file.
 *  `sample()`: which one the file is of, from 1.
 *  @param {Result} item @param {Choices} choices @param {Item[]} materials
 *  @param {{sample: () => number, signal: AbortSignal, made: () => Promise<void>}} more */
export function exportForm(item, choices, materials, { sample, signal, made }) {
  const character = choices.forms.export.filter(({ kind }) => kind === "brought");
  const own = character.map((one) => [one.name, broughtAs(one, materials, signal)]);
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
  const status = h("p", { class: "hint", role: "status" });
  const problem = h("div");
  const button = h("button", { type: "submit", class: "main" }, "Make the file");
  const order = () => ({ kind: "export", result: item.id, ...saidIn({ to, skeleton, ...more }), sample: sample() });
  return h(
    "form",
    { class: "stack", ...sends(button, problem, () => carryOut(order(), { status, problem, signal, made })) },
    to.node,
    folded("Options", grid(more), skeleton.node),
    inRow(button),
    status,
    problem,
  );
}

/** @param {object} order @param {Telling} telling */
async function carryOut(order, { status, problem, signal, made }) {
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
  put(status, "Here it is: ", fileList(job.files ?? []));
  announce("The file is written.");
  await made();
}
