// The mount by points: each a point of the phone, clicked where it was on the object.
import { box, h, stacked } from "../core/dom.js";
import { mountLook } from "./mount_look.js";
import { mountForm, objectField, phoneFields } from "./mount_form.js";
import { phonePicture } from "./phone_picture.js";
import { PointPicker } from "./pick_points.js";
/** @import {Context} from "../calibrate/recorded.js" */

/** @param {Context} context */
export function pointsForm({ choices, objects, object, back, signal }) {
  const picker = new PointPicker({
    names: cornersFirst(choices.phone_points),
    enough: 3,
    label: "This point of the phone",
    words,
    picture: phonePicture,
    signal,
  });
  const thing = objectField(objects, object, (id) => picker.show(id));
  const phone = phoneFields(choices.phones);
  picker.show(object);
  const read = () => ({
    method: "points",
    object: thing.read(),
    ...phone.read(),
    pairs: picker.points.map(({ name, at }) => ({ phone: name, point: at })),
    sigma_mm: 2,
  });
  const look = mountLook({
    stage: picker.stage,
    read: () => (picker.points.length >= 2 && phone.known() ? read() : null),
    signal,
  });
  picker.addEventListener("change", look.ask);
  phone.node.addEventListener("change", look.ask);
  const content = stacked(thing.node, phone.node, picker.content, look.node);
  return box(
    "split",
    stacked(picker.stage.node, picker.status),
    h("section", { class: "card" }, mountForm({ back, name: "Mount by points", content, read })),
  );
}

/** Corners are easy to see, and far apart. @param {string[]} names */
function cornersFirst(names) {
  /** @param {string} name */
  const corner = (name) => Number(/^(top|bottom) (left|right)/.test(name));
  return [...names].sort((a, b) => corner(b) - corner(a));
}

/** @param {{chosen: string, left: number}} now */
function words({ chosen, left }) {
  if (left > 0) return `Click where the phone's “${chosen}” is on the object. ${left} more at least.`;
  if (left === 0) return "Enough to try. One or two more, far from the others, show mistakes.";
  return "Does the phone stand as you clamped it? Then keep this mount, or add more points.";
}
