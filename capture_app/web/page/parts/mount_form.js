// What the forms of a mount share: the name, the phone, and what happens when it is kept.
import { api } from "../core/api.js";
import { h } from "../core/dom.js";
import { address, go } from "../core/router.js";
import { attempt, choice, number } from "./fields.js";
/** @import {Thing} from "../core/answers.js" */

const RULER = "";

/** A form around fields that makes a mount; `read()` gives the body of POST /api/mounts.
 *  @param {{back: string | null, name: string, content: Node, read: () => object}} asked */
export function mountForm({ back, name, content, read }) {
  const title = h("input", { value: name, maxlength: 120, required: true });
  const problem = h("div");
  const button = h("button", { type: "submit", class: "main" }, "Keep this mount");
  return h(
    "form",
    {
      class: "stack",
      on: {
        submit: (event) => {
          event.preventDefault();
          attempt(button, problem, async () => {
            const made = await api("/api/mounts", {
              json: { name: title.value.trim(), ...read() },
            });
            go(address(`/mounts/${made.id}`, { back }));
          });
        },
      },
    },
    content,
    h("label", { class: "field" }, h("span", {}, "Name of the mount"), title),
    h("div", { class: "row" }, button),
    problem,
  );
}

/** Which phone: a known model, or one that is measured. @param {string[]} phones */
export function phoneFields(phones) {
  const model = choice(
    "Phone",
    [...phones.map((name) => [name, name]), [RULER, "Another: measure it"]],
    { value: phones.findLast((name) => /^iPhone \d+ Pro$/.test(name)) ?? phones[0] },
  );
  const ruler = [
    number("Width", { unit: "mm", min: 30, max: 200 }),
    number("Height", { unit: "mm", min: 80, max: 300 }),
    number("Main lens from the top edge", { unit: "mm", min: 0, max: 200 }),
    number("Main lens from the left edge, seen from behind", {
      unit: "mm",
      min: 0,
      max: 200,
    }),
  ];
  const measured = h(
    "div",
    { class: "grid" },
    ruler.map((one) => one.node),
  );
  const show = () => {
    measured.hidden = model.read() !== RULER;
    for (const one of ruler) one.input.required = !measured.hidden;
  };
  model.input.addEventListener("change", show);
  show();
  return {
    node: h("div", { class: "stack" }, model.node, measured),
    read: () =>
      model.read() === RULER
        ? { phone: "measured", ruler: ruler.map((one) => one.read()) }
        : { phone: model.read() },
  };
}

/** Which object the mount is for; `changed(id)` when another is chosen.
 *  @param {Thing[]} objects @param {string | null} current @param {(id: string) => void} changed */
export function objectField(objects, current, changed) {
  const options = [["", "Choose the object"], ...objects.map(({ id, name }) => [id, name])];
  const object = choice("Object", options, { value: current ?? "" });
  object.input.addEventListener("change", () => changed(object.read()));
  return object;
}
