// Files to download.
import { h } from "../core/dom.js";
import { size } from "../core/words.js";

/** A list of links. @param {import("../core/answers.js").Made[]} files */
export function fileList(files) {
  if (files.length === 0) return null;
  return h(
    "ul",
    { class: "files" },
    files.map((file) =>
      h(
        "li",
        {},
        h("a", { href: file.href, download: file.name }, file.name),
        h("span", { class: "hint figures" }, size(file.size)),
      ),
    ),
  );
}
