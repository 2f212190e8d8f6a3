// Find where the phone sits on the object: which way, and the form of that way.
import { api } from "../core/api.js";
import { box, h, put, stacked } from "../core/dom.js";
import { address } from "../core/router.js";
import { wayForm } from "../calibrate/way_form.js";
import { drawingForm } from "../parts/mount_drawing.js";
import { identityForm } from "../parts/mount_form.js";
import { pointsForm } from "../parts/mount_points.js";
/** @import {WayDescribed} from "../core/answers.js"
 *  @import {Context} from "../calibrate/way_form.js"
 *  @import {Visit} from "../core/router.js" */

/** Title, words, and the form. @typedef {[string, string, (context: Context) => Node]} Way */

/** @type {Record<string, Way>} */
const BY_HAND = {
  points: [
    "Click points on the object",
    "You have the mesh and can see where the phone's corners were. Notices mistakes from the fourth point on.",
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
};
const BROUGHT = ["choices", "objects", "sessions", "videos", "materials", "mounts", "calibration"];

/** `#/calibrate?object=ID&way=points&back=...` @param {Visit} visit */
export async function calibrate({ query, signal }) {
  const [choices, objects, sessions, videos, materials, mounts, guide] = await Promise.all(
    BROUGHT.map((what) => api(`/api/${what}`, { signal })),
  );
  const [recommended, ...recorded] = Object.entries(guide.ways).map(([key, way]) => [key, recordedWay(way)]);
  const groups = [[recommended], recorded, Object.entries(BY_HAND)].map((ways) => Object.fromEntries(ways));
  const known = Object.assign({}, ...groups);
  const page = box("stack");
  const ways = box("stack");
  const node = box(
    "stack wide",
    h(
      "header",
      {},
      h("h1", {}, "Where does the phone sit on the object?"),
      h("p", { class: "lead" }, "All that is made hangs on this. Do it once for each time you clamp the phone."),
    ),
    ways,
    page,
  );
  let inner = new AbortController();
  /** @param {URLSearchParams} now */
  const update = (now) => {
    inner.abort();
    inner = new AbortController();
    const way = now.get("way");
    drawWays(ways, groups, way, now);
    /** @type {Context} */
    const context = {
      ...{ choices, objects, sessions, videos, materials, mounts, guide },
      object: now.get("object"),
      back: now.get("back"),
      signal: AbortSignal.any([signal, inner.signal]),
    };
    put(page, way && known[way]?.[2](context));
  };
  update(query);
  return { title: "Find the mount", node, update };
}

/** @param {WayDescribed} way @returns {Way} */
const recordedWay = (way) => [way.title, way.hint, (context) => wayForm(way, context)];

/** @param {HTMLElement} place @param {Record<string, Way>[]} groups @param {string | null} current
 *  @param {URLSearchParams} query */
function drawWays(place, [recommended, recorded, byHand], current, query) {
  const active = document.activeElement;
  const focused = active instanceof HTMLInputElement && active.value === current;
  put(
    place,
    group("Recommended", recommended, current, query),
    h(
      "details",
      { open: current !== null && !(current in recommended) },
      h("summary", {}, "Other ways"),
      stacked(
        group("Record something else", recorded, current, query),
        group("Without a recording", byHand, current, query),
      ),
    ),
  );
  /** @type {HTMLInputElement | null} */
  const again = place.querySelector(`input[value="${current}"]`);
  if (focused) again?.focus();
}

/** @param {string} legend @param {Record<string, Way>} ways @param {string | null} current
 *  @param {URLSearchParams} query */
function group(legend, ways, current, query) {
  const kept = Object.fromEntries(query);
  return h(
    "fieldset",
    { class: "picks" },
    h("legend", {}, legend),
    Object.entries(ways).map(([way, [title, text]]) => {
      const input = h("input", {
        type: "radio",
        name: "way",
        value: way,
        checked: way === current,
        on: { change: () => (location.hash = address("/calibrate", { ...kept, way })) },
      });
      return h("label", { class: "pick" }, input, h("span", {}, h("b", {}, title), h("span", { class: "hint" }, text)));
    }),
  );
}
