// A stored mount: how it was found, and how sure it is.
import { api } from "../core/api.js";
import { h } from "../core/dom.js";
import { itemHead } from "../core/library.js";
import { address, parse } from "../core/router.js";
import { few, mountWords } from "../parts/cards.js";
import { mountWarning } from "../parts/pick_mount.js";

/** `#/mounts/ID?back=...` */
export async function mount({ params, query, signal }) {
  const item = await api(`/api/mounts/${params.id}`, { signal });
  const facts = [
    ["Place", item.bounds && `± ${few(item.bounds.mm)} mm`],
    ["Direction", item.bounds && `± ${few(item.bounds.deg)}°`],
    ["Phone", item.phone],
    ["Found on", item.date],
    ...Object.entries(item.residuals).map(([key, value]) => residual(key, value)),
  ].filter(([, value]) => value);
  const node = h(
    "div",
    { class: "narrow stack" },
    itemHead("mounts", item, mountWords(item)),
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
    useIt(item, query.get("back")),
  );
  return { title: item.name, node };
}

/** {"rms_mm": 1.2} -> ["Left over (rms)", "1.2 mm"]. */
function residual(key, value) {
  const [, what, unit] = /^(.*)_(mm|deg|px|s)$/.exec(key) ?? [null, key, ""];
  return [
    `Left over (${what.replaceAll("_", " ")})`,
    `${value.toFixed(2)} ${unit === "deg" ? "°" : unit}`.trim(),
  ];
}

function useIt(item, back) {
  if (!back?.startsWith("#/sessions/")) return null;
  const { path, query } = parse(back);
  const chosen = { ...Object.fromEntries(query), mount: item.id };
  return h(
    "div",
    { class: "row" },
    h("a", { class: "button main", href: address(path, chosen) }, "Use it for the recording"),
  );
}
