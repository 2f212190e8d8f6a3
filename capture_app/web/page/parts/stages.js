// The stages of a job, each with its state and time.
import { h } from "../core/dom.js";
import { STAGES, span, stagesOf } from "../core/words.js";
/** @import {Job} from "../core/answers.js" */

/** The stage a job is in, in words. @param {Job} job */
export function stageWords(job) {
  return STAGES[job.stage] ?? (job.stage || "Starting");
}

/** All stages of a job as a list. @param {Job} job */
export function stageList(job) {
  const known = stagesOf(job.kind);
  const seen = [...Object.keys(job.timings), job.stage].filter(Boolean);
  const stages = [...known, ...seen.filter((stage, at) => !known.includes(stage) && seen.indexOf(stage) === at)];
  return h("ol", { class: "stages" }, stages.map((stage) => item(stage, job)));
}

/** @param {string} stage @param {Job} job */
function item(stage, job) {
  const now = job.state === "running" && job.stage === stage;
  const taken = job.timings[stage];
  const state = now ? "now" : taken === undefined ? "later" : "over";
  const mark = { now: "●", later: "○", over: "✓" }[state];
  return h(
    "li",
    { class: state, "aria-current": now ? "step" : null },
    h("span", { class: "mark", "aria-hidden": "true" }, mark),
    h("span", {}, STAGES[stage] ?? stage),
    h("span", { class: "figures hint" }, state === "over" ? span(taken) : now ? "now" : ""),
  );
}
