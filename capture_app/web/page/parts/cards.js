// Things in the library as cards and rows.
import { h } from "../core/dom.js";
import { KINDS, STATES, ago, ended, sides, span } from "../core/words.js";
import { stageWords } from "./stages.js";

const TRIES = 5;
const WAIT = 3000; // milliseconds

/** A small picture of a thing; a new one is drawn after it was asked for, so it is asked again. */
export function poster(kind, id, width, height) {
  const src = `/api/${kind}/${id}/picture`;
  let tries = 0;
  const again = () => {
    tries += 1;
    picture.classList.add("none");
    if (tries < TRIES)
      setTimeout(() => picture.isConnected && (picture.src = `${src}?${tries}`), WAIT * tries);
  };
  const picture = h("img", {
    src,
    alt: "",
    loading: "lazy",
    width,
    height,
    on: { error: again, load: () => picture.classList.remove("none") },
  });
  return picture;
}

/** A result: picture, name, where it comes from. */
export function resultCard(result) {
  return h(
    "a",
    { class: "card tile", href: `#/results/${result.id}` },
    h("div", { class: "picture" }, poster("results", result.id, 480, 270)),
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

/** A session, object or mount in a list. */
export function itemRow(kind, item, ...buttons) {
  const path = `#/${kind}/${item.id}`;
  const pictured = kind === "objects" || (kind === "mounts" && item.object);
  return h(
    "li",
    { class: pictured ? "row-item pictured" : "row-item" },
    pictured && h("span", { class: "thumb" }, poster(kind, item.id, 56, 56)),
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

/** A number with decimals where they say something. */
export function few(value) {
  return value.toFixed(value < 0.1 ? 2 : value < 10 ? 1 : 0);
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
