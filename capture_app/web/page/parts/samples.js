// Which of the samples is shown: one, or all beside each other.
import { freshId, h } from "../core/dom.js";

const MOST = 6; // beside each other

/** Radio buttons for the samples; `show(samples)` with indices from 0. None for a single one.
 *  @param {number} samples @param {number} chosen @param {(samples: number[]) => void} show */
export function samplePicker(samples, chosen, show) {
  if (!(samples > 1)) return null;
  const name = freshId("sample");
  /** @param {string} words @param {number[]} list */
  const option = (words, list) =>
    h(
      "label",
      { class: "pill" },
      h("input", {
        type: "radio",
        name,
        checked: list.length === 1 && list[0] === chosen,
        on: { change: () => show(list) },
      }),
      h("span", {}, words),
    );
  const all = [...Array(samples).keys()];
  const beside = all.slice(0, MOST);
  return h(
    "fieldset",
    { class: "pills" },
    h("legend", {}, "Samples"),
    all.map((k) => option(k === chosen ? `${k + 1} (best)` : `${k + 1}`, [k])),
    option(samples > MOST ? `First ${MOST} side by side` : "All side by side", beside),
  );
}
