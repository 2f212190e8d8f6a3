// Things in the library as cards and rows.
import { api } from "../core/api.js";
import { box, h } from "../core/dom.js";
import { KINDS, STATES, ago, ended, sides, span } from "../core/words.js";
import { stageWords } from "./stages.js";
import { badge, verdictOf } from "./verdicts.js";
/** @import {Job, Motion, Mount, Session, Shelf, Thing} from "../core/answers.js" */

/** @typedef {Session | Thing | Mount} Stored */

const TRIES = 100;
const WAIT = 1000; // milliseconds, and longer from time to time
const LONGEST = 5000;
const MOST = 100; // pictures of one request

/** Pictures that are on the screen and not drawn yet, by what they are of.
 *  @type {Map<HTMLImageElement, string>} */
const waiting = new Map();
const seen = new IntersectionObserver((all) => {
  for (const { target, isIntersecting } of all) {
    if (!isIntersecting || !(target instanceof HTMLImageElement)) continue;
    seen.unobserve(target);
    waiting.set(target, target.dataset.of ?? "");
    ask(0);
  }
});
let asking = 0;

/** A small picture of a thing.
 *  @param {Shelf} kind @param {string} id @param {number} width @param {number} height */
export function poster(kind, id, width, height) {
  return drawnLater(`${kind}/${id}/picture`, width, height);
}

/** A picture at an address behind /api/, which is drawn after it was asked for: it is loaded when it is there.
 *  @param {string} of @param {number} width @param {number} height */
export function drawnLater(of, width, height) {
  const picture = h("img", { class: "none", alt: "", width, height, "data-of": of });
  seen.observe(picture);
  return picture;
}

/** Ask in one request which of the pictures that are waited for are there. @param {number} tries */
function ask(tries) {
  clearTimeout(asking);
  asking = setTimeout(
    async () => {
      const query = new URLSearchParams([...new Set(waiting.values())].slice(0, MOST).map((of) => ["of", of]));
      /** @type {Record<string, string>} */
      const states = await api(`/api/pictures?${query}`).catch(() => ({}));
      for (const [picture, of] of waiting) {
        if (states[of] === "ready") {
          picture.src = `/api/${of}`;
          picture.classList.remove("none");
        }
        const over = ["ready", "none"].includes(states[of]) || tries >= TRIES;
        if (over || !picture.isConnected) waiting.delete(picture);
      }
      if (waiting.size) ask(tries + 1);
    },
    Math.min(LONGEST, WAIT * tries),
  );
}

/** A result: picture, name, where it comes from. @param {Motion} result */
export function resultCard(result) {
  return h(
    "a",
    { class: "card tile", href: `#/results/${result.id}` },
    box("picture", poster("results", result.id, 480, 270)),
    h("span", { class: "tile-name" }, result.name),
    badge(verdictOf("results", result)),
    h(
      "span",
      { class: "hint" },
      [result.seconds && span(result.seconds), result.parent ? "corrected" : null, ago(result.created)]
        .filter(Boolean)
        .join(" · "),
    ),
  );
}

/** A session, object or mount in a list.
 *  @param {Shelf} kind @param {Stored} item @param {HTMLElement[]} buttons */
export function itemRow(kind, item, ...buttons) {
  const path = `#/${kind}/${item.id}`;
  const pictured = "extents" in item || ("object" in item && item.object);
  return h(
    "li",
    { class: pictured ? "row-item pictured" : "row-item" },
    pictured && h("span", { class: "thumb" }, poster(kind, item.id, 56, 56)),
    h("a", { href: path, class: "row-name" }, item.name),
    h(
      "span",
      { class: "row-told" },
      h("span", { class: "hint" }, [details(item), ago(item.created)].filter(Boolean).join(" · ")),
      badge(verdictOf(kind, item)),
    ),
    buttons.length > 0 && h("span", { class: "row" }, buttons),
  );
}

/** What is worth knowing about an item, in a line. @param {Stored} item */
export function details(item) {
  if ("extents" in item) return sides(item.extents);
  if ("method" in item) return item.found;
  const seconds = item.seconds ? span(item.seconds) : "";
  return [item.app, seconds].filter(Boolean).join(" · ");
}

/** A job in a list, with its progress. @param {Job} job */
export function jobRow(job) {
  const live = !ended(job);
  return h(
    "li",
    { class: "row-item" },
    h("a", { href: `#/jobs/${job.id}`, class: "row-name" }, job.name || KINDS[job.kind]),
    h("span", { class: "hint" }, live && job.state === "running" ? stageWords(job) : STATES[job.state]),
    live && h("progress", { max: 1, value: job.fraction, "aria-label": `Progress of ${job.name}` }),
  );
}
