// Words and actions shared by all that lies in the library.
import { api } from "./api.js";
import { action, h, hintLine, inRow } from "./dom.js";
import { address, go, parse } from "./router.js";
import { confirmed, renamed } from "../parts/dialog.js";
/** @import {Item, Shelf} from "./answers.js"
 *  @import {Child} from "./dom.js" */

/** @type {Record<Shelf, string>} */
export const ONE = { sessions: "recording", objects: "object", mounts: "mount", results: "motion" };

/** Rename and delete buttons of an item; `changed(item)` after a new name.
 *  @param {Shelf} kind @param {Item} item @param {(item: Item) => void} changed */
export function itemButtons(kind, item, changed) {
  const rename = async () => {
    await renamed(item.name, async (/** @type {string} */ name) => {
      Object.assign(item, await api(`/api/${kind}/${item.id}`, { method: "PATCH", json: { name } }));
      changed(item);
    });
  };
  return [action("quiet", rename, "Rename"), action("quiet", () => remove(kind, item), "Delete")];
}

/** @param {Shelf} kind @param {Item} item */
async function remove(kind, item) {
  const done = await confirmed({
    title: `Delete “${item.name}”?`,
    text: `The ${ONE[kind]} and its files are deleted from this computer. This cannot be undone.`,
    yes: "Delete it",
    act: () => api(`/api/${kind}/${item.id}`, { method: "DELETE" }),
  });
  if (done) go("#/library");
}

/** A heading that follows the item's name, with what can be done to the item.
 *  @param {Shelf} kind @param {Item} item @param {Child} line @param {Child[]} more */
export function itemHead(kind, item, line, ...more) {
  const name = h("h1", {}, item.name);
  const changed = () => {
    name.textContent = item.name;
    document.title = `${item.name} · omocap`;
  };
  return h(
    "header",
    { class: "head" },
    h("div", {}, name, line && hintLine(line)),
    inRow(more, itemButtons(kind, item, changed)),
  );
}

/** A link that uses the item there; null without a recording. kind: "mount" or "object".
 *  @param {string} kind @param {{id: string}} item @param {string | null} back */
export function useIt(kind, item, back) {
  if (!back?.startsWith("#/sessions/")) return null;
  const { path, query } = parse(back);
  const chosen = { ...Object.fromEntries(query), [kind]: item.id };
  return inRow(h("a", { class: "button main", href: address(path, chosen) }, "Use it for the recording"));
}
