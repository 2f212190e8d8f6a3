// Motions beside each other, on one clock.
import { api, freshKey } from "../core/api.js";
import { box, h, inRow, part, put, stacked } from "../core/dom.js";
import { address, go, toJob } from "../core/router.js";
import { span } from "../core/words.js";
import { doing } from "../parts/fields.js";
import { Stage } from "../parts/stage.js";
/** @import {Motion, Result} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js" */

const MOST = 4;
/** @type {[string, string, (score: number) => string][]} */
const SCORES = [
  ["unheld", "Moves without a hand on it", (x) => `${(100 * x).toFixed(0)} %`],
  ["miss_cm", "Palms off their places", (x) => `${x.toFixed(1)} cm`],
  ["inside_cm", "Body without hands inside the object", (x) => `${x.toFixed(1)} cm`],
  ["hands_inside_cm", "Holding hands inside the object", (x) => `${x.toFixed(1)} cm`],
  ["wrists_beyond", "Holding wrists bent too far", (x) => `${(100 * x).toFixed(0)} %`],
  ["skate_cm_s", "Feet sliding", (x) => `${x.toFixed(1)} cm/s`],
  ["leaping", "Leaps faster than people", (x) => (x > 0 ? "yes" : "no")],
  ["total", "Score, less is better", (x) => x.toFixed(2)],
];

/** `#/compare?results=ID,ID,...` @param {Visit} visit */
export async function compare({ query, signal }) {
  const results = await api("/api/results", { signal });
  const page = new Comparison(results, signal);
  page.update(query);
  const update = (/** @type {URLSearchParams} */ next) => page.update(next);
  return { title: "Compare", node: page.node, update };
}

class Comparison {
  /** @type {string[]} */
  chosen = [];
  /** @type {Map<string, HTMLInputElement> | null} */
  boxes = null;

  /** @param {Motion[]} results @param {AbortSignal} signal */
  constructor(results, signal) {
    this.results = results;
    this.signal = signal;
    this.stage = new Stage({ label: "The motions beside each other in 3D", signal });
    this.stage.addEventListener("opened", () => this.arrange());
    this.picks = h("fieldset", { class: "picks" });
    this.hint = h("p", { class: "hint", role: "status" });
    this.numbers = h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Numbers" });
    this.problem = h("div");
    this.over = h("input", { type: "checkbox", on: { change: () => this.arrange() } });
    this.on = stacked(
      this.stage.node,
      h("label", { class: "tick" }, this.over, h("span", {}, "On top of each other")),
      this.numbers,
      inRow(doing("Make a video of this", () => this.film(), { place: this.problem })),
      this.problem,
    );
    this.node = box(
      "stack wide",
      h("h1", {}, "Compare motions"),
      this.hint,
      this.on,
      part("Which motions", this.picks),
    );
  }

  /** @param {URLSearchParams} query */
  update(query) {
    const asked = (query.get("results") ?? "").split(",");
    this.chosen = asked.filter((id) => this.results.some((one) => one.id === id)).slice(0, MOST);
    this.drawPicks();
    const few = this.chosen.length < 2;
    this.on.hidden = few;
    put(this.hint, this.results.length === 0 ? "There is no motion yet." : few ? "Choose two or more below." : "");
    if (few) return;
    this.stage.open(this.chosen.map((id) => ({ url: `/api/results/${id}/scene`, name: this.named(id) })));
    this.drawNumbers();
  }

  /** @param {string} id */
  named(id) {
    return this.results.find((one) => one.id === id)?.name ?? "";
  }

  arrange() {
    this.stage.viewer?.arrange(this.over.checked ? "over" : "side");
    this.stage.label();
  }

  drawPicks() {
    if (this.boxes) {
      for (const [id, tickBox] of this.boxes) tickBox.checked = this.chosen.includes(id);
      return;
    }
    const boxes = new Map();
    this.boxes = boxes;
    put(
      this.picks,
      h("legend", { class: "unseen" }, "Motions"),
      this.results.map((one) => {
        const tickBox = h("input", {
          type: "checkbox",
          checked: this.chosen.includes(one.id),
          on: { change: () => this.toggle(one.id, tickBox.checked) },
        });
        boxes.set(one.id, tickBox);
        const line = [one.object_name, one.seconds && span(one.seconds), one.parent && "corrected"]
          .filter(Boolean)
          .join(" · ");
        return h(
          "label",
          { class: "pick" },
          tickBox,
          h("span", {}, h("b", {}, one.name), h("span", { class: "hint" }, line)),
        );
      }),
    );
  }

  /** @param {string} id @param {boolean} on */
  toggle(id, on) {
    const kept = this.chosen.filter((one) => one !== id);
    const next = on ? [...kept, id].slice(-MOST) : kept;
    go(address("/compare", { results: next.join(",") }));
  }

  film() {
    return toJob({ kind: "compare", results: this.chosen }, freshKey());
  }

  async drawNumbers() {
    /** @type {Result[]} */
    const all = await Promise.all(this.chosen.map((id) => api(`/api/results/${id}`, { signal: this.signal })));
    /** @param {typeof SCORES[number]} score */
    const row = ([key, words, show]) =>
      h(
        "tr",
        {},
        h("th", { scope: "row" }, words),
        all.map(({ manifest }) => h("td", {}, show(manifest.scores[manifest.chosen]?.[key] ?? 0))),
      );
    put(
      this.numbers,
      h(
        "table",
        {},
        h(
          "thead",
          {},
          h(
            "tr",
            {},
            h("td", {}),
            all.map((one) => h("th", { scope: "col" }, h("a", { href: `#/results/${one.id}` }, one.name))),
          ),
        ),
        h("tbody", {}, SCORES.map(row)),
      ),
    );
  }
}
