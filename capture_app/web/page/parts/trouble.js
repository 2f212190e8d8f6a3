// What went wrong, calmly: what, where, and how to fix it.
import { goTo, h, inRow } from "../core/dom.js";
/** @import {ApiError} from "../core/api.js"
 *  @import {Problem} from "../core/answers.js" */

/** A box for an error of the server; `buttons` are ways out of it.
 *  @param {Problem} error @param {HTMLElement[]} buttons */
export function trouble(error, ...buttons) {
  return h(
    "div",
    { class: "trouble", role: "alert" },
    h("p", { class: "trouble-what" }, error.what),
    error.fix && h("p", {}, h("b", {}, "What to do: "), error.fix),
    error.where && h("p", { class: "trouble-where" }, error.where),
    buttons.length > 0 && inRow(buttons),
  );
}

/** A whole page that cannot be shown. @param {ApiError} error */
export function troublePage(error) {
  const gone = error.status === 404;
  const fix = "It may have been deleted. Everything that is there stands in the library.";
  return h(
    "section",
    { class: "narrow" },
    h("h1", {}, gone ? "This is not here" : "This cannot be shown"),
    trouble(gone ? { what: error.what, fix } : error),
    inRow(goTo("#/", "To the start"), h("a", { class: "button quiet", href: "#/library" }, "To the library")),
  );
}
