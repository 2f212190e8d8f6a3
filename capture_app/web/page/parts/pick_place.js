// Where in the mesh of a room the object stands, by a click on it.
import { stacked } from "../core/dom.js";
import { PointPicker } from "./pick_points.js";

/** Where in a room the object stands, by a click. {node, picker, read()} @param {AbortSignal} signal */
export function standsAt(signal) {
  const picker = new PointPicker({
    names: ["The place"],
    enough: 1,
    label: "The place",
    what: "room",
    scene: (id) => `/api/rooms/${id}/scene`,
    words: ({ left }) => (left > 0 ? "Click on the object." : "Good."),
    signal,
  });
  const node = stacked(picker.stage.node, picker.status, picker.content);
  const read = () => ({ method: "mesh", at: picker.points[0]?.at ?? null });
  return { node, picker, read };
}
