// A take report: the verdict in large words, what to do first, each check with what, where, fix.
import { action, box, h } from "../core/dom.js";
import { capital, count, stretch } from "../core/words.js";
/** @import {Check, Report, Severity} from "../core/answers.js" */

/** Shows a second of the recording. @typedef {(seconds: number) => void} Seek */

/** @type {Record<string, [Severity, string]>} */
const VERDICTS = {
  good: ["ok", "This recording is good"],
  "usable with limits": ["warn", "This recording is usable with limits"],
  "not usable": ["bad", "This recording is not usable"],
  "not judged": ["ok", "This is an object's own motion"],
};
const BADGES = { ok: "✓ good", warn: "! look", bad: "✕ bad" };

/** The verdict box. @param {Report} report */
export function verdict(report) {
  const [kind, words] = VERDICTS[report.verdict] ?? ["warn", capital(report.verdict)];
  return h(
    "div",
    { class: `verdict ${kind}` },
    h("p", { class: "verdict-words" }, words),
    report.reason && h("p", {}, capital(report.reason)),
    kind === "ok"
      ? h("p", {}, "Nothing is to be done: go on.")
      : report.advice && h("p", {}, h("b", {}, "To do first: "), report.advice),
  );
}

/** All checks, the worst first; those that are well are folded up. `seek` shows a place.
 *  @param {Check[]} checks @param {Seek | null} seek */
export function checkList(checks, seek = null) {
  const troubles = ["bad", "warn"].flatMap((kind) => checks.filter((one) => one.severity === kind));
  const well = checks.filter((one) => one.severity === "ok");
  return h(
    "div",
    {},
    troubles.length > 0 &&
      h("ul", { class: "checks" }, troubles.map((one) => item(one, seek))),
    well.length > 0 &&
      h(
        "details",
        {},
        h("summary", {}, `${BADGES.ok}: ${count(well.length, "check")}`),
        h("ul", { class: "checks" }, well.map((one) => item(one, null))),
      ),
  );
}

/** @param {Check} check @param {Seek | null} seek */
function item(check, seek) {
  return h(
    "li",
    {},
    h("span", { class: `badge ${check.severity}` }, BADGES[check.severity]),
    h("span", { class: "check-name" }, capital(check.name)),
    box(
      "check-what",
      check.message,
      " ",
      where(check, seek),
      check.fix && h("p", { class: "fix" }, h("b", {}, "Do: "), check.fix),
    ),
  );
}

/** @param {Check} check @param {Seek | null} seek */
function where(check, seek) {
  if (!check.seconds) {
    return check.frames && h("span", { class: "hint" }, `poses ${check.frames[0]} to ${check.frames[1] - 1}`);
  }
  const words = stretch(check.seconds);
  const first = check.seconds.find((time) => time !== null);
  if (!seek || first === undefined) return h("span", { class: "hint" }, words);
  return action("link", () => seek(first), `Show ${words}`);
}
