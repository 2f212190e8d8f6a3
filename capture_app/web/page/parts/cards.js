// Things in the library as cards and rows.
import { h } from "../core/dom.js";
import { KINDS, STATES, ago, ended, sides, span } from "../core/words.js";
import { stageWords } from "./stages.js";

/** A result: picture, name, where it comes from. */
export function resultCard(result) {
  const picture = result.thumbnail
    ? h("img", { src: result.thumbnail, alt: "", loading: "lazy", width: 320, height: 180 })
    : film(result.video);
  return h(
    "a",
    { class: "card tile", href: `#/results/${result.id}` },
    h("div", { class: "picture" }, picture),
    h("span", { class: "tile-name" }, result.name),
    h(
      "span",
      { class: "hint" },
      [
        result.seconds && span(result.seconds),
        result.parent ? "corrected" : null,
        ago(result.created),
      ]
        .filter(Boolean)
        .join(" · "),
    ),
  );
}

// The media fragment makes the browser draw a frame instead of black.
function film(video) {
  if (!video) return h("span", { class: "no-picture", "aria-hidden": "true" }, "no video");
  return h("video", {
    src: `${video}#t=2`,
    preload: "metadata",
    muted: true,
    tabindex: "-1",
    "aria-hidden": "true",
  });
}

/** A session, object or mount in a list. */
export function itemRow(kind, item, ...buttons) {
  const path = `#/${kind}/${item.id}`;
  return h(
    "li",
    { class: "row-item" },
    h("a", { href: path, class: "row-name" }, item.name),
    h(
      "span",
      { class: "hint" },
      [details(kind, item), ago(item.created)].filter(Boolean).join(" · "),
    ),
    buttons.length > 0 && h("span", { class: "row" }, buttons),
  );
}

/** What is worth knowing about an item, in a line. */
export function details(kind, item) {
  if (kind === "objects") return item.extents ? sides(item.extents) : "";
  if (kind === "mounts") return mountWords(item);
  const seconds = item.seconds ? span(item.seconds) : "";
  return [item.app, seconds].filter(Boolean).join(" · ");
}

const METHODS = {
  board: "a board and a second camera",
  session: "scan and clamp in one recording",
  scan: "a scan that shows the phone",
  screen: "pictures of the phone's screen",
  tracker: "motion capture",
  drawing: "numbers of a drawing",
  points: "points on phone and object",
  floor: "standing on the floor",
  combine: "several calibrations",
  identity: "taken as the phone itself",
};

/** How a mount was found, and within what it is true 95 times of 100. */
export function mountWords(mount) {
  const way = METHODS[mount.method] ?? mount.method;
  if (mount.method === "identity") return way;
  return `by ${way}, ${boundWords(mount.bounds)}`;
}

/** {mm, deg} in words. */
export function boundWords(bounds) {
  if (!bounds) return "error unknown";
  return `within ${few(bounds.mm)} mm and ${few(bounds.deg)}°`;
}

/** A number with one decimal where that says something. */
export function few(value) {
  return value.toFixed(value < 10 ? 1 : 0);
}

/** A job in a list, with its progress. */
export function jobRow(job) {
  const live = !ended(job);
  return h(
    "li",
    { class: "row-item" },
    h("a", { href: `#/jobs/${job.id}`, class: "row-name" }, job.name || KINDS[job.kind]),
    h(
      "span",
      { class: "hint" },
      live && job.state === "running" ? stageWords(job) : STATES[job.state],
    ),
    live && h("progress", { max: 1, value: job.fraction, "aria-label": `Progress of ${job.name}` }),
  );
}
