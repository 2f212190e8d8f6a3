// What the forms of a mount share: the name, the phone, and what happens when it is kept.
import { api } from "../core/api.js";
import { box, h, inRow, say, stacked } from "../core/dom.js";
import { address, go } from "../core/router.js";
import { choice, number, sends } from "./fields.js";
/** @import {Phone, Thing} from "../core/answers.js" */

const RULER = "";
const MEASURE = "measure its lens";
const HOW =
  "Measure with a ruler, in millimetres. The main lens is the one that darkens the picture at 1× " +
  "when you cover it.";

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
      ...sends(button, problem, async () => {
        const made = await api("/api/mounts", { json: { name: title.value.trim(), ...read() } });
        go(address(`/mounts/${made.id}`, { back }));
      }),
    },
    content,
    h("label", { class: "field" }, h("span", {}, "Name of the mount"), title),
    inRow(button),
    problem,
  );
}

/** Which phone: a model whose lens is known, or one on which it is measured. @param {Phone[]} phones */
export function phoneFields(phones) {
  const known = phones.filter((one) => one.lens_known);
  const model = choice(
    "Phone",
    [
      ...phones.map(({ name, lens_known }) => [name, lens_known ? name : `${name}: ${MEASURE}`]),
      [RULER, `Another: ${MEASURE}`],
    ],
    { value: (known.findLast(({ name }) => / Pro$/.test(name)) ?? known.at(-1))?.name ?? RULER },
  );
  const [width, height, ...lens] = [
    number("Width", { unit: "mm", min: 30, max: 200 }),
    number("Height", { unit: "mm", min: 80, max: 300 }),
    number("Main lens from the top edge", { unit: "mm", min: 0, max: 200 }),
    number("Main lens from the left edge, seen from behind", { unit: "mm", min: 0, max: 200 }),
  ];
  const ruler = [width, height, ...lens];
  const why = h("p", { class: "hint" });
  const measured = stacked(why, box("grid", ruler.map((one) => one.node)));
  const chosen = () => phones.find(({ name }) => name === model.read());
  const show = () => {
    const phone = chosen();
    measured.hidden = Boolean(phone?.lens_known);
    for (const one of ruler) one.input.required = !measured.hidden;
    say(why, phone ? `Nobody published where the lens of an ${phone.name} is. ${HOW}` : HOW);
    width.input.value = phone ? String(phone.width) : "";
    height.input.value = phone ? String(phone.height) : "";
  };
  model.input.addEventListener("change", show);
  show();
  return {
    node: stacked(model.node, measured),
    /** Whether all is said that is asked. */
    known: () => measured.hidden || ruler.every((one) => one.read() !== null),
    read: () => ({
      phone: model.read() || "measured",
      ruler: chosen()?.lens_known ? null : ruler.map((one) => one.read()),
    }),
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

/** The mount of a mesh that is made in the phone's own axes. @param {{back: string | null}} context */
export function identityForm({ back }) {
  const content = h(
    "p",
    {},
    "The origin of the mesh is the phone's camera: x to the right and y up in " +
      "the picture, z out of the screen towards you. Nothing is to be measured.",
  );
  return h(
    "section",
    { class: "card" },
    mountForm({ back, name: "Mesh around the phone", content, read: () => ({ method: "identity" }) }),
  );
}
