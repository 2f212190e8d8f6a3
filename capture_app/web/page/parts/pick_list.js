// Choose one stored thing: radio buttons as cards.
import { freshId, h } from "../core/dom.js";

/** items: [{id, name, line}]; `chosen(id)` when one is taken.
 *  @param {string} legend @param {{id: string, name: string, line: string}[]} items
 *  @param {string | null} current @param {(id: string) => void} chosen */
export function pickList(legend, items, current, chosen) {
  const name = freshId("pick");
  return h(
    "fieldset",
    { class: "picks" },
    h("legend", { class: "unseen" }, legend),
    items.map((item) => {
      const input = h("input", {
        type: "radio",
        name,
        value: item.id,
        checked: item.id === current,
        on: { change: () => chosen(item.id) },
      });
      return h(
        "label",
        { class: "pick" },
        input,
        h("span", {}, h("b", {}, item.name), h("span", { class: "hint" }, item.line)),
      );
    }),
  );
}
