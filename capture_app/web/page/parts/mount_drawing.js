// The mount by numbers: where a point of the phone is on the object, and how the phone is turned.
import { box, h, stacked } from "../core/dom.js";
import { sides } from "../core/words.js";
import { showAxes } from "./axes.js";
import { choice, number } from "./fields.js";
import { mountLook } from "./mount_look.js";
import { mountForm, objectField, phoneFields } from "./mount_form.js";
import { Stage } from "./stage.js";
/** @import {Context} from "../calibrate/way_form.js" */

const AXES = ["+x", "-x", "+y", "-y", "+z", "-z"].map((axis) => [axis, axis]);
const SURE = [
  ["1", "Printed from a drawing (1 mm, 1°)"],
  ["3", "Measured with a ruler (3 mm, 3°)"],
  ["10", "By eye (1 cm, 10°)"],
];

/** @param {Context} context */
export function drawingForm({ choices, objects, object, back, signal }) {
  const stage = new Stage({
    label: "The object in 3D, with the phone's point on it",
    signal,
    controls: false,
  });
  const size = h("p", { class: "hint" });
  showAxes(stage);
  /** @param {string | null} id */
  const show = (id) => {
    const item = objects.find((one) => one.id === id);
    stage.node.hidden = !item;
    size.textContent = item ? `${item.name}: ${sides(item.extents)} along x, y, z.` : "";
    if (item) stage.open([{ url: `/api/objects/${id}/scene`, name: item.name }]);
  };
  const thing = objectField(objects, object, show);
  const phone = phoneFields(choices.phones);
  const point = choice(
    "Point of the phone",
    choices.phone_points.map((name) => [name, name]),
    { value: "centre front", hint: "Left and right as you look at the screen." },
  );
  const place = ["x", "y", "z"].map((axis) => number(axis, { unit: "cm", required: true }));
  const faces = choice("The screen faces", AXES, { value: "+z" });
  const top = choice("The top edge points", AXES, { value: "+y" });
  const sure = choice("How do you know", SURE, { value: "3" });
  const xyz = () => place.map((one) => (one.read() ?? 0) / 100);
  for (const one of place) one.input.addEventListener("input", () => stage.mark([xyz()]));
  const content = stacked(
    box("grid", thing.node, phone.node),
    h(
      "fieldset",
      { class: "grid" },
      h("legend", {}, "Where it is, in the object's own axes"),
      point.node,
      box("thirds", place.map((one) => one.node)),
    ),
    h("fieldset", { class: "grid" }, h("legend", {}, "How it is turned"), faces.node, top.node),
    sure.node,
  );
  const read = () => ({
    method: "drawing",
    object: thing.read() || null,
    ...phone.read(),
    point: point.read(),
    xyz: xyz(),
    axes: `screen faces ${faces.read()}, top edge points ${top.read()}`,
    sigma_mm: Number(sure.read()),
    sigma_deg: Number(sure.read()),
  });
  const said = () => thing.read() && phone.known() && place.every((one) => one.read() !== null);
  const look = mountLook({ stage, read: () => (said() ? read() : null), signal });
  for (const event of ["input", "change"]) content.addEventListener(event, look.ask);
  stage.addEventListener("opened", look.ask);
  show(object);
  return box(
    "split",
    h("section", { class: "card" }, mountForm({ back, name: "Mount by numbers", content, read })),
    stacked(stage.node, size, look.node),
  );
}
