// Questions in a native dialog: focus is kept inside, Escape closes, focus goes back where it was.
import { inWords } from "../core/api.js";
import { action, box, freshId, h, put } from "../core/dom.js";
import { trouble } from "./trouble.js";

/** @typedef {() => Promise<unknown>} Act */
/** @typedef {{title: string, yes: string, act: Act, content: Node, danger?: boolean,
 *    only?: boolean}} Question */

/** Ask before something that cannot be undone. Resolves to whether `act` was done.
 *  @param {{title: string, text: string, yes: string, act: Act}} asked */
export function confirmed({ title, text, yes, act }) {
  return ask({ title, yes, act, danger: true, content: h("p", {}, text) });
}

/** Ask for a name; `act(name)` keeps it.
 *  @param {string} name @param {(name: string) => Promise<unknown>} act */
export function renamed(name, act) {
  const field = h("input", { value: name, maxlength: 120, required: true, autofocus: true });
  const content = h("label", { class: "field" }, h("span", {}, "Name"), field);
  return ask({ title: "Rename", yes: "Keep this name", content, act: () => act(field.value.trim()) });
}

/** Show content with one button that closes it. @param {string} title @param {Node} content */
export function shown(title, content) {
  return ask({ title, yes: "Close", content, act: async () => {}, only: true });
}

/** @param {Question} question @returns {Promise<boolean>} */
function ask({ title, yes, act, content, danger = false, only = false }) {
  const id = freshId("dialog");
  const problem = h("div");
  const done = h("button", { class: danger ? "danger" : "main", type: "submit" }, yes);
  const no = action("quiet", () => dialog.close(), "Cancel");
  const buttons = box("row end", only ? null : no, done);
  const form = h("form", {}, h("h2", { id }, title), content, problem, buttons);
  const dialog = h("dialog", { "aria-labelledby": id }, form);
  const leave = () => dialog.close();
  return new Promise((resolve) => {
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      carryOut(act, done, problem).then((good) => good && dialog.close("yes"));
    });
    addEventListener("hashchange", leave);
    dialog.addEventListener("close", () => {
      removeEventListener("hashchange", leave);
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** @param {Act} act @param {HTMLButtonElement} button @param {HTMLElement} problem */
async function carryOut(act, button, problem) {
  button.disabled = true;
  try {
    await act();
    return true;
  } catch (error) {
    put(problem, trouble(inWords(error)));
    button.disabled = false;
    return false;
  }
}
