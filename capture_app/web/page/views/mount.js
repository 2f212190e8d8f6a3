// A stored mount: how it was found, and how sure it is.
import { api } from "../core/api.js";
import { box, factList, h, hintLine, stacked } from "../core/dom.js";
import { itemHead, useIt } from "../core/library.js";
import { mountWarning } from "../parts/pick_mount.js";
import { Stage } from "../parts/stage.js";
/** @import {Mount} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js" */

/** `#/mounts/ID?back=...` @param {Visit} visit */
export async function mount({ params, query, signal }) {
  /** @type {Mount} */
  const item = await api(`/api/mounts/${params.id}`, { signal });
  const facts = [["Phone", item.phone], ["Found on", item.date]].filter(([, value]) => value);
  const node = box(
    "narrow stack",
    itemHead("mounts", item, item.found),
    item.object && onObject(item, signal),
    facts.length > 0 && factList(facts),
    h("ul", { class: "told" }, item.sure.map((text) => h("li", {}, text))),
    mountWarning(item) ?? hintLine(item.method === "identity" ? "The mesh is made in the phone's own axes." : ""),
    useIt("mount", item, query.get("back")),
  );
  return { title: item.name, node };
}

/** The phone on the object in 3D, and what its camera sees.
 *  @param {Mount} item @param {AbortSignal} signal */
function onObject(item, signal) {
  const stage = new Stage({ label: "The phone on the object in 3D", signal, controls: false });
  stage.open([{ url: `/api/mounts/${item.id}/scene`, name: item.name }]);
  return stacked(stage.node, hintLine("Is the phone where you clamped it? Blue is what its camera sees."));
}
