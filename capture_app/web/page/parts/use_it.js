// The way back to the recording that something was made for.
import { h, inRow } from "../core/dom.js";
import { address, parse } from "../core/router.js";

/** A link that uses the item there; null without a recording. kind: "mount" or "object".
 *  @param {string} kind @param {{id: string}} item @param {string | null} back */
export function useIt(kind, item, back) {
  if (!back?.startsWith("#/sessions/")) return null;
  const { path, query } = parse(back);
  const chosen = { ...Object.fromEntries(query), [kind]: item.id };
  return inRow(h("a", { class: "button main", href: address(path, chosen) }, "Use it for the recording"));
}
