// Whether a thing of the library is good to use, as far as it is known: a word and a mark in every list.
import { h } from "../core/dom.js";
import { count } from "../core/words.js";
/** @import {Motion, Mount, Session, Severity, Shelf, Thing} from "../core/answers.js" */

/** @typedef {Session | Thing | Mount | Motion} Any */
/** `kind`: "unknown" where nobody has looked yet. @typedef {{kind: Severity | "unknown", words: string}} Verdict */

const MARKS = { ok: "✓", warn: "!", bad: "✕", unknown: "?" };
/** @type {Record<string, Verdict>} */
const RECORDINGS = {
  good: { kind: "ok", words: "good" },
  "usable with limits": { kind: "warn", words: "usable with limits" },
  "not usable": { kind: "bad", words: "not usable" },
  "not judged": { kind: "ok", words: "an object's own motion" },
};
/** @type {Record<Severity, Verdict>} */
const SCANS = {
  ok: { kind: "ok", words: "a good scan" },
  warn: { kind: "warn", words: "a scan with limits" },
  bad: { kind: "bad", words: "a bad scan" },
};
/** @type {Verdict} */
const UNKNOWN = { kind: "unknown", words: "not looked at yet" };
/** @type {Verdict} */
const GOOD = { kind: "ok", words: "good" };

/** @param {Shelf} shelf @param {Any} item @returns {Verdict} */
export function verdictOf(shelf, item) {
  if (shelf === "sessions") return ("verdict" in item && RECORDINGS[item.verdict ?? ""]) || UNKNOWN;
  if ("extents" in item) return ofObject(item);
  if ("method" in item) return ofMount(item);
  const faults = "faults" in item ? (item.faults ?? []).length + (item.findings ?? []).length : 0;
  return faults ? { kind: "warn", words: count(faults, "thing to look at", "things to look at") } : GOOD;
}

/** The mark and the words. @param {Verdict} verdict */
export function badge({ kind, words }) {
  return h("span", { class: `badge ${kind}` }, h("span", { "aria-hidden": "true" }, `${MARKS[kind]} `), words);
}

/** @param {Thing} item @returns {Verdict} */
function ofObject({ scan, warnings }) {
  if (scan && scan.severity !== "ok") return SCANS[scan.severity];
  if (warnings?.length) return { kind: "warn", words: "look at its mesh" };
  return scan ? SCANS.ok : GOOD;
}

/** @param {Mount} item @returns {Verdict} */
function ofMount({ bounds, method, warnings }) {
  if (method === "identity") return GOOD;
  if (warnings.length) return { kind: "warn", words: "not sure enough" };
  return bounds ? GOOD : { kind: "unknown", words: "error unknown" };
}
