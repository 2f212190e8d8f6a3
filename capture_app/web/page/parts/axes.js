// The axes of an object, drawn over its 3D view, so that numbers can be given along them.
import { put, svg } from "../core/dom.js";
/** @import {Viewer} from "/static/viewer/viewer.js"
 *  @import {Stage} from "./stage.js" */

const COLOURS = ["#d1453b", "#2f8f46", "#2f6fd6"];

/** Axes over a stage that shows one object. @param {Stage} stage */
export function showAxes(stage) {
  const picture = svg("svg", { class: "axes", "aria-hidden": "true" });
  stage.frame.append(picture);
  const draw = () => stage.viewer && put(picture, lines(stage.viewer));
  stage.addEventListener("opened", () => stage.viewer?.addEventListener("drawn", draw));
}

/** @param {Viewer} viewer */
function lines(viewer) {
  const pack = viewer.pack(0);
  if (!pack) return [];
  // The view raises the object until it stands on the floor.
  const origin = pack.need("object_position");
  const farthest = pack.need("object_vertices").reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  const from = viewer.project([...origin]);
  return ["x", "y", "z"].map((name, axis) => {
    const end = [...origin];
    end[axis] += 1.5 * farthest;
    const to = viewer.project(end);
    return svg(
      "g",
      { stroke: COLOURS[axis], fill: COLOURS[axis] },
      svg("line", { x1: from.x, y1: from.y, x2: to.x, y2: to.y }),
      svg("text", { x: to.x + 5, y: to.y + 5 }, `+${name}`),
    );
  });
}
