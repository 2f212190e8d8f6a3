// The mount by points: each a point of the phone, clicked where it was on the object.
import { box, h, stacked, svg } from "../core/dom.js";
import { mountLook } from "./mount_look.js";
import { mountForm, objectField, phoneFields } from "./mount_form.js";
import { PointPicker } from "./pick_points.js";
/** @import {Context} from "../calibrate/way_form.js" */

const [WIDTH, HEIGHT, EDGE] = [56, 112, 12];

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

/** A drawing of the phone that shows which of its points is meant.
 *  `point`: such as "top left back corner"; left and right as one looks at the screen.
 *  @param {string} point */
function phonePicture(point) {
  const back = /back|lens/.test(point);
  const middle = WIDTH / 2;
  const side = point === "lens" ? "right" : /left|right/.exec(point)?.[0];
  // Seen from behind, left and right change places.
  const left = (side === "left") !== back;
  const inset = point === "lens" ? 13 : 0;
  const x = side ? (left ? inset : WIDTH - inset) : middle;
  const y = point === "lens" ? 13 : /top/.test(point) ? 0 : /bottom/.test(point) ? HEIGHT : HEIGHT / 2;
  const label = `${point}, seen from ${back ? "behind" : "the front"}`;
  return svg(
    "svg",
    {
      class: "phone",
      viewBox: `-10 -10 ${WIDTH + 20} ${HEIGHT + 34}`,
      width: 84,
      height: 161,
      role: "img",
      "aria-label": label,
    },
    svg("rect", { class: "case", width: WIDTH, height: HEIGHT, rx: 9 }),
    back ? lenses() : svg("rect", { class: "screen", x: 4, y: 4, width: WIDTH - 8, height: HEIGHT - 8, rx: 6 }),
    svg("circle", { class: "point", cx: x, cy: y, r: 5.5 }),
    svg("text", { x: middle, y: HEIGHT + EDGE + 8, "text-anchor": "middle" }, back ? "from behind" : "from the front"),
  );
}

function lenses() {
  return svg(
    "g",
    {},
    svg("rect", { class: "screen", x: 5, y: 5, width: 25, height: 25, rx: 7 }),
    svg("circle", { class: "glass", cx: 13, cy: 13, r: 5 }),
    svg("circle", { class: "glass", cx: 22, cy: 22, r: 5 }),
  );
}
