// Which of the samples is shown: small motions of all of them, to choose one by a look.
import { freshId, h } from "../core/dom.js";
/** @import {Stage} from "./stage.js" */

const MOST = 6; // beside each other

/** Radio buttons for the samples; `show(samples)` with indices from 0. None for a single one.
 *  @param {number} samples @param {number} chosen @param {(samples: number[]) => void} show
 *  @param {Stage} stage plays the samples, too */
export function samplePicker(samples, chosen, show, stage) {
  if (!(samples > 1)) return null;
  const name = freshId("sample");
  /** @param {string} words @param {number[]} list @param {HTMLElement[]} picture */
  const option = (words, list, ...picture) =>
    h(
      "label",
      { class: "sample" },
      h("input", {
        type: "radio",
        name,
        checked: list.length === 1 && list[0] === chosen,
        on: { change: () => show(list) },
      }),
      h("span", {}, words),
      picture,
    );
  const all = [...Array(samples).keys()];
  const pictures = all.map(() => h("canvas", { "aria-hidden": "true" }));
  // Who waits for the motion does not wait for them.
  const draw = async () => {
    const { drawSamples } = await import("./sample_views.js");
    if (stage.viewer) drawSamples(pictures, stage.viewer);
  };
  for (const event of ["opened", "revised"]) stage.addEventListener(event, draw);
  return h(
    "fieldset",
    { class: "samples" },
    h("legend", { class: "unseen" }, "Samples"),
    all.map((k) => option(k === chosen ? `${k + 1} (best)` : `${k + 1}`, [k], pictures[k])),
    option(samples > MOST ? `First ${MOST} side by side` : "All side by side", all.slice(0, MOST)),
  );
}
