// The axes of an object, drawn over its 3D view, so that numbers can be given along them.
import { put, svg } from "../core/dom.js";

const COLOURS = ["#d1453b", "#2f8f46", "#2f6fd6"];

/** Axes over a stage that shows one object. */
export function showAxes(stage) {
  const picture = svg("svg", { class: "axes", "aria-hidden": "true" });
  stage.frame.append(picture);
  const draw = () => stage.viewer?.header(0) && put(picture, lines(stage.viewer));
  const soon = () => requestAnimationFrame(draw);
  stage.addEventListener("opened", draw);
  for (const event of ["pointermove", "wheel", "keydown"])
    stage.canvas.addEventListener(event, soon);
  new ResizeObserver(soon).observe(stage.canvas);
}

function lines(viewer) {
  // The view raises the object until it stands on the floor.
  const origin = viewer.pack(0).array("object_position");
  const farthest = viewer
    .pack(0)
    .array("object_vertices")
    .reduce((most, x) => Math.max(most, Math.abs(x)), 0);
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
