// Everything that lies in the library.
import { api } from "../core/api.js";
import { h } from "../core/dom.js";
import { itemRow, jobRow, resultCard } from "../parts/cards.js";
import { size } from "../core/words.js";

const PARTS = [
  ["sessions", "Recordings"],
  ["objects", "Objects"],
  ["mounts", "Mounts"],
];

/** `#/library` */
export async function library({ signal }) {
  const kinds = ["results", ...PARTS.map(([kind]) => kind), "jobs", "health"];
  const [results, sessions, objects, mounts, jobs, health] = await Promise.all(
    kinds.map((what) => api(`/api/${what}`, { signal })),
  );
  const lists = { sessions, objects, mounts };
  const used = [...results, ...sessions, ...objects, ...mounts].reduce(
    (sum, one) => sum + one.size,
    0,
  );
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
        h(
          "ul",
          { class: "rows" },
          jobs.map((job) => jobRow(job)),
        ),
      ),
  );
  return { title: "Library", node };
}
