// Everything that lies in the library.
import { api } from "../core/api.js";
import { h } from "../core/dom.js";
import { itemRow, jobRow, resultCard } from "../parts/cards.js";
import { size } from "../core/words.js";
/** @import {Item, Shelf} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js"
 *  @import {Stored} from "../parts/cards.js" */

/** @type {[Exclude<Shelf, "results">, string][]} */
const PARTS = [
  ["sessions", "Recordings"],
  ["objects", "Objects"],
  ["mounts", "Mounts"],
];

/** `#/library` @param {Visit} visit */
export async function library({ signal }) {
  const kinds = ["results", ...PARTS.map(([kind]) => kind), "jobs", "health"];
  const [results, sessions, objects, mounts, jobs, health] = await Promise.all(
    kinds.map((what) => api(`/api/${what}`, { signal })),
  );
  /** @type {Record<string, Stored[]>} */
  const lists = { sessions, objects, mounts };
  /** @type {Item[]} */
  const all = [...results, ...sessions, ...objects, ...mounts];
  const used = all.reduce((sum, one) => sum + one.size, 0);
  const node = h(
    "div",
    { class: "stack wide" },
    h(
      "header",
      { class: "head" },
      h(
        "div",
        {},
        h("h1", {}, "Library"),
        h(
          "p",
          { class: "hint" },
          `${size(used)} used, ${size(health.free_bytes)} free on this disk`,
        ),
      ),
    ),
    h(
      "section",
      {},
      h("h2", {}, "Motions"),
      results.length
        ? h("div", { class: "tiles" }, results.map(resultCard))
        : h("p", { class: "hint" }, "None yet. ", h("a", { href: "#/" }, "Drop a recording")),
    ),
    PARTS.map(([kind, words]) =>
      h(
        "section",
        {},
        h("h2", {}, words),
        lists[kind].length
          ? h(
              "ul",
              { class: "rows" },
              lists[kind].map((one) => itemRow(kind, one)),
            )
          : h("p", { class: "hint" }, "None yet."),
      ),
    ),
    jobs.length > 0 &&
      h(
        "details",
        {},
        h("summary", {}, `Jobs (${jobs.length})`),
        h("ul", { class: "rows" }, jobs.map(jobRow)),
      ),
  );
  return { title: "Library", node };
}
