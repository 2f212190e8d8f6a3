// Everything that lies in the library: searched by name, and filtered by how good it is.
import { api } from "../core/api.js";
import { box, folded, h, hintLine, part, put, say, stacked } from "../core/dom.js";
import { store, stored } from "../core/stored.js";
import { count, size } from "../core/words.js";
import { itemRow, jobRow, resultCard } from "../parts/cards.js";
import { choice, field } from "../parts/fields.js";
import { verdictOf } from "../parts/verdicts.js";
/** @import {Job, Shelf} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js"
 *  @import {Any} from "../parts/verdicts.js" */

/** @type {[Shelf, string][]} */
const PARTS = [["results", "Motions"], ["sessions", "Recordings"], ["objects", "Objects"], ["mounts", "Mounts"]];
const FILTERS = [
  ["", "all"],
  ["ok", "good"],
  ["warn", "to be looked at"],
  ["bad", "not usable"],
  ["unknown", "not known"],
];
const KEPT = "library";

/** `#/library` @param {Visit} visit */
export async function library({ signal }) {
  const kinds = [...PARTS.map(([kind]) => kind), "jobs", "health"];
  const answers = await Promise.all(kinds.map((what) => api(`/api/${what}`, { signal })));
  const [jobs, health] = answers.slice(PARTS.length);
  /** @type {[Shelf, string, Any[]][]} */
  const shelves = PARTS.map(([kind, words], at) => [kind, words, answers[at]]);
  const used = shelves.flatMap(([, , items]) => items).reduce((sum, one) => sum + one.size, 0);
  const room = `${size(used)} used, ${size(health.free_bytes)} free on this disk`;
  const node = box(
    "stack wide",
    h("header", {}, h("h1", {}, "Library"), hintLine(room)),
    found(shelves),
    jobsPart(jobs),
  );
  return { title: "Library", node };
}

/** The search, the filter, and what they leave. @param {[Shelf, string, Any[]][]} shelves */
function found(shelves) {
  const kept = stored(sessionStorage, KEPT) ?? {};
  const search = h("input", { type: "search", value: String(kept.search ?? "") });
  const filter = choice("Show", FILTERS, { value: String(kept.filter ?? "") });
  const told = h("p", { class: "hint", role: "status" });
  const list = box("stack");
  const show = () => {
    const word = search.value.trim().toLowerCase();
    const wanted = filter.read();
    store(sessionStorage, KEPT, { search: search.value, filter: wanted });
    const fits = shelves.map(([kind, , items]) =>
      items.filter((one) => one.name.toLowerCase().includes(word) && (!wanted || verdictOf(kind, one).kind === wanted)),
    );
    const total = fits.reduce((sum, some) => sum + some.length, 0);
    say(told, word || wanted ? `${count(total, "thing")} found.` : "");
    put(list, shelves.map(([kind, words, all], at) => shelf(kind, words, all, fits[at])));
  };
  search.addEventListener("input", show);
  filter.input.addEventListener("change", show);
  show();
  const tools = box("grid", field("Search by name", search), filter.node);
  return stacked(h("search", {}, tools), told, list);
}

/** @param {Shelf} kind @param {string} words @param {Any[]} all @param {Any[]} some */
function shelf(kind, words, all, some) {
  if (all.length > 0 && some.length === 0) return null;
  const none = ["None yet. ", kind === "results" && h("a", { href: "#/" }, "Drop a recording")];
  const cards = some.map((one) => ("samples" in one ? resultCard(one) : itemRow(kind, one)));
  return part(
    words,
    all.length === 0
      ? hintLine(none)
      : h(kind === "results" ? "div" : "ul", { class: kind === "results" ? "tiles" : "rows" }, cards),
  );
}

/** @param {Job[]} jobs */
function jobsPart(jobs) {
  if (jobs.length === 0) return null;
  return folded(`Jobs (${jobs.length})`, h("ul", { class: "rows" }, jobs.map(jobRow)));
}
