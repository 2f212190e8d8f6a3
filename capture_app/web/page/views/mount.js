// A stored mount: how it was found, and how sure it is.
import { api } from "../core/api.js";
import { h } from "../core/dom.js";
import { itemHead } from "../core/library.js";
import { capital } from "../core/words.js";
import { few, mountWords } from "../parts/mount_words.js";
import { mountWarning } from "../parts/pick_mount.js";
import { Stage } from "../parts/stage.js";
import { useIt } from "../parts/use_it.js";
/** @import {Mount} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js" */

/** `#/mounts/ID?back=...` @param {Visit} visit */
export async function mount({ params, query, signal }) {
  /** @type {Mount} */
  const item = await api(`/api/mounts/${params.id}`, { signal });
  const facts = [
    ["Place", item.bounds && `± ${few(item.bounds.mm)} mm`],
    ["Direction", item.bounds && `± ${few(item.bounds.deg)}°`],
    ["Phone", item.phone],
    ["Found on", item.date],
    ...Object.entries(item.residuals).flatMap(([key, value]) => residual(key, value)),
  ].filter(([, value]) => value);
  const node = h(
    "div",
    { class: "narrow stack" },
    itemHead("mounts", item, mountWords(item)),
    item.object && onObject(item, signal),
    facts.length > 0 &&
      h(
        "dl",
        { class: "facts" },
        facts.map(([key, value]) => h("div", {}, h("dt", {}, key), h("dd", {}, value))),
      ),
    item.bounds &&
      h(
        "p",
        { class: "hint" },
        "The true place and direction are within these bounds 95 times of 100, if " +
          "the numbers it was made from are right.",
      ),
    mountWarning(item) ??
      h(
        "p",
        { class: "hint" },
        item.method === "identity" ? "The mesh is made in the phone's own axes." : "",
      ),
    useIt("mount", item, query.get("back")),
  );
  return { title: item.name, node };
}

/** The phone on the object in 3D, and what its camera sees.
 *  @param {Mount} item @param {AbortSignal} signal */
function onObject(item, signal) {
  const stage = new Stage({ label: "The phone on the object in 3D", signal, controls: false });
  stage.open([{ url: `/api/mounts/${item.id}/scene`, name: item.name }]);
  return h(
    "div",
    { class: "stack" },
    stage.node,
    h("p", { class: "hint" }, "Is the phone where you clamped it? Blue is what its camera sees."),
  );
}

/** {"rms_mm": 1.2} -> [["Left over (rms)", "1.2 mm"]]; nothing for what tells only programs.
 *  @param {string} key @param {number} value */
function residual(key, value) {
  const [, what, unit] = /^(.*)_(mm|m|deg|px|%|s)$/.exec(key) ?? [null, key, ""];
  // The clocks of two devices differ by anything.
  if (unit === "s") return [];
  const words = what.replaceAll("_", " ");
  if (unit === "%") return [[capital(words), `${value.toFixed(Math.abs(value) < 10 ? 1 : 0)} %`]];
  const size = `${value.toFixed(2)} ${unit === "deg" ? "°" : unit}`.trim();
  // What was taken out is not left over.
  return [[words.startsWith("drift") ? capital(words) : `Left over (${words})`, size]];
}
