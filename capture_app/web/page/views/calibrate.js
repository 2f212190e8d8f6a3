// Find where the phone sits on the object: which way, and the two ways that need no recording.
import { api } from "../core/api.js";
import { h, put } from "../core/dom.js";
import { address } from "../core/router.js";
import { drawingForm } from "../parts/mount_drawing.js";
import { identityForm } from "../parts/mount_identity.js";
import { pointsForm } from "../parts/mount_points.js";
import { otherWays } from "../parts/mount_ways.js";

const WAYS = {
  points: [
    "Click points on the object",
    "You have the mesh and can see where the phone's corners were. Notices " +
      "mistakes from the fourth point on.",
    pointsForm,
  ],
  drawing: [
    "Numbers from a drawing or a ruler",
    "The holder was printed from a drawing, or you measured where the phone is. Believes what you say.",
    drawingForm,
  ],
  identity: [
    "The mesh is made around the phone",
    "The mesh already has the phone's own axes and origin.",
    identityForm,
  ],
  recording: [
    "Record something: the surest",
    "With a printed board, a scan, or another camera: a few millimetres and tenths of a degree.",
    otherWays,
  ],
};

/** `#/calibrate?object=ID&way=points&back=...` */
export async function calibrate({ query, signal }) {
  const [choices, objects] = await Promise.all(
    ["choices", "objects"].map((what) => api(`/api/${what}`, { signal })),
  );
  const page = h("div", { class: "stack" });
  const ways = h("fieldset", { class: "picks" });
  const node = h(
    "div",
    { class: "stack wide" },
    h(
      "header",
      {},
      h("h1", {}, "Where does the phone sit on the object?"),
      h(
        "p",
        { class: "lead" },
        "All that is made hangs on this. Do it once for each time you clamp the phone.",
      ),
    ),
    ways,
    page,
  );
  let inner = new AbortController();
  const update = (now) => {
    inner.abort();
    inner = new AbortController();
    const way = now.get("way");
    drawWays(ways, way, now);
    const context = {
      choices,
      objects,
      object: now.get("object"),
      back: now.get("back"),
      signal: AbortSignal.any([signal, inner.signal]),
    };
    put(page, WAYS[way]?.[2](context));
  };
  update(query);
  return { title: "Find the mount", node, update };
}

function drawWays(place, current, query) {
  const kept = Object.fromEntries(query);
  const focused = document.activeElement?.value;
  put(
    place,
    h("legend", {}, "How do you want to find it?"),
    Object.entries(WAYS).map(([way, [title, text]]) => {
      const input = h("input", {
        type: "radio",
        name: "way",
        value: way,
        checked: way === current,
        on: { change: () => (location.hash = address("/calibrate", { ...kept, way })) },
      });
      return h(
        "label",
        { class: "pick" },
        input,
        h("span", {}, h("b", {}, title), h("span", { class: "hint" }, text)),
      );
    }),
  );
  if (focused && focused === current) place.querySelector(`input[value="${current}"]`)?.focus();
}
