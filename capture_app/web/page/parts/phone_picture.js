// A drawing of the phone that shows which of its points is meant.
import { svg } from "../core/dom.js";

const [WIDTH, HEIGHT, EDGE] = [56, 112, 12];

/** `point`: such as "top left back corner"; left and right as one looks at the screen.
 *  @param {string} point */
export function phonePicture(point) {
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
