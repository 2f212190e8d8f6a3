// One thing that a form needs: taken from the library, or dropped; looked at as soon as it is there.
import { api, inWords } from "../core/api.js";
import { box, h, hintLine, put, stacked } from "../core/dom.js";
import { ago } from "../core/words.js";
import { begin } from "../upload/begin.js";
import { dropArea } from "../upload/drop.js";
import { order } from "../upload/gather.js";
import { choice } from "./fields.js";
import { trouble } from "./trouble.js";
/** @import {Described, Item, Looked} from "../core/answers.js" */

/** @typedef {"session" | "video" | "material"} Kind */
/** @typedef {(id: string, signal: AbortSignal) => Promise<Looked>} Look */
/** @typedef {{label: string, kind: Kind, items: Item[], current?: string | null, title: string,
 *    text?: string, accept?: string, folder?: boolean, signal: AbortSignal, look?: Look | null,
 *    changed?: (id: string) => void}} Asked */

/** A field of a form that the API describes so. @param {Described} one @param {Item[]} items
 *  @param {AbortSignal} signal @param {Pick<Asked, "look" | "changed">} more */
export function broughtAs({ title, shelves: [kind], drop, accept, look: looks }, items, signal, more = {}) {
  const [head, text] = drop;
  const area = { title: head, text, accept: accept || undefined, folder: !accept };
  return brought({ label: title, kind, items, signal, ...more, look: looks ? more.look : null, ...area });
}

/** kind: of the upload; items: those that are stored, of any kinds; `title`, `text`, `accept` and
 *  `folder` of the drop area; `look(id)` -> a promise of {good, doubts, notes}, or null for none.
 *  {node, read(), lookAgain()}; "changed" is told by `changed(id)`.
 *  @param {Asked} asked */
export function brought({
  label,
  kind,
  items,
  current = "",
  title,
  text = "",
  accept,
  folder = false,
  signal,
  look = null,
  changed = () => {},
}) {
  const told = h("div", { "aria-live": "polite" });
  const place = box("stack");
  /** @param {Item} one */
  const words = (one) => `${one.name}, ${ago(one.created)}`;
  const stored = choice(label, [["", "None yet"], ...items.map((one) => [one.id, words(one)])], {
    value: items.find(({ id }) => id === current)?.id ?? "",
  });
  let looking = new AbortController();
  const lookAgain = async () => {
    looking.abort();
    looking = new AbortController();
    const inner = AbortSignal.any([signal, looking.signal]);
    put(told);
    if (!look || !stored.read()) return;
    const asked = look(stored.read(), inner);
    put(told, h("p", { class: "hint waiting" }, "Looking at it…"));
    try {
      put(told, found(await asked));
    } catch (error) {
      if (!inner.aborted) put(told, trouble(inWords(error)));
    }
  };
  stored.input.addEventListener("change", () => {
    changed(stored.read());
    lookAgain();
  });
  const area = dropArea({
    title,
    text,
    folder,
    accept,
    small: true,
    took: async (roots) => {
      const [item] = await begin(roots, place, [order(kind, roots)]);
      /** @type {Item} */
      const one = await api(`/api/${SHELVES[kind]}/${item.id}`);
      stored.input.append(h("option", { value: one.id }, words(one)));
      put(place);
      stored.input.value = one.id;
      stored.input.dispatchEvent(new Event("change", { bubbles: true }));
    },
  });
  if (stored.read()) lookAgain();
  return {
    node: stacked(stored.node, area, place, told),
    read: () => stored.read() || null,
    lookAgain,
    stored,
  };
}

const SHELVES = { session: "sessions", video: "videos", material: "materials" };

/** What a look showed. @param {Looked} looked */
export function found({ good, doubts, notes }) {
  return [
    doubts.length ? h("p", {}, good) : h("p", { class: "good" }, h("span", { "aria-hidden": "true" }, "✓ "), good),
    doubts.length > 0 &&
      box("note", doubts.map((doubt) => h("p", {}, doubt))),
    notes.map((note) => hintLine(note)),
  ];
}
