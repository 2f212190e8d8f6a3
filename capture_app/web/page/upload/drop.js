// A place where files are dropped, or chosen by buttons.
import { box, h, hintLine } from "../core/dom.js";
import { fromDrop, fromField } from "./gather.js";
/** @import {Root} from "./gather.js" */

/** @typedef {(roots: Root[]) => unknown} Took */

/** The drop area. `took(roots)` gets what was dropped or chosen. `accept`: endings for the dialog.
 *  @param {{title: string, text: string, took: Took, folder?: boolean, accept?: string,
 *    small?: boolean}} asked */
export function dropArea({ title, text, took, folder = true, accept = "", small = false }) {
  const files = h("input", { type: "file", multiple: true, accept, hidden: true });
  const tree = h("input", { type: "file", webkitdirectory: "", hidden: true });
  for (const input of [files, tree]) {
    input.addEventListener("change", () => {
      const roots = fromField(input);
      input.value = "";
      if (roots.length) took(roots);
    });
  }
  const area = h(
    "div",
    { class: small ? "drop small" : "drop" },
    h("p", { class: "drop-title" }, title),
    text && hintLine(text),
    box(
      "row centre",
      folder &&
        h(
          "button",
          { type: "button", class: small ? "" : "main", on: { click: () => tree.click() } },
          "Choose a folder",
        ),
      h(
        "button",
        {
          type: "button",
          class: folder || small ? "" : "main",
          on: { click: () => files.click() },
        },
        folder ? "Choose files or an archive" : "Choose a file",
      ),
    ),
    files,
    tree,
  );
  receive(area, took);
  return area;
}

/** @param {HTMLElement} area @param {Took} took */
function receive(area, took) {
  let inside = 0;
  const lit = () => area.classList.toggle("over", inside > 0);
  area.addEventListener("dragenter", (event) => (event.preventDefault(), (inside += 1), lit()));
  area.addEventListener("dragleave", () => ((inside -= 1), lit()));
  area.addEventListener("dragover", (event) => event.preventDefault());
  area.addEventListener("drop", async (event) => {
    event.preventDefault();
    inside = 0;
    lit();
    const roots = event.dataTransfer ? await fromDrop(event.dataTransfer) : [];
    if (roots.length) took(roots);
  });
}
