// Find where the phone sits on the object: which way, and the form of that way.
import { api } from "../core/api.js";
import { box, h, put, stacked } from "../core/dom.js";
import { address } from "../core/router.js";
import * as recorded from "../calibrate/ways.js";
import { drawingForm } from "../parts/mount_drawing.js";
import { identityForm } from "../parts/mount_form.js";
import { pointsForm } from "../parts/mount_points.js";
/** @import {Context} from "../calibrate/recorded.js"
 *  @import {Visit} from "../core/router.js" */

/** Title, words, and the form. @typedef {[string, string, (context: Context) => Node]} Way */

/** @type {Record<string, Way>} */
const RECOMMENDED = {
  filmed: [
    "Board, and only the phone",
    "You need a printer. The phone films a printed board on the object, and is then clamped without " +
      "stopping the log.",
    recorded.filmed,
  ],
};
/** @type {Record<string, Way>} */
const RECORDED = {
  board: [
    "Board, and a second camera on a tripod",
    "The surest. You turn the object for 20 seconds: a few millimetres and tenths of a degree.",
    recorded.board,
  ],
  meshed: [
    "The phone's own scan (LiDAR)",
    "Scan the object and clamp the phone in one recording; the app gives the mesh of it.",
    recorded.meshed,
  ],
  scan: [
    "The object's scan, found again",
    "The object was made from a film of it, and stands there still: two seconds at rest.",
    recorded.scan,
  ],
  tracker: ["Motion capture, or a tracker on the object", "It follows the same motion as the phone.", recorded.tracker],
  floor: [
    "Make a mount surer by the floor",
    "From any recording in which the object stands on the floor.",
    recorded.floor,
  ],
};
/** @type {Record<string, Way>} */
const BY_HAND = {
  points: [
    "Click points on the object",
    "You have the mesh and can see where the phone's corners were. Notices " + "mistakes from the fourth point on.",
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
const WAYS = { ...RECOMMENDED, ...RECORDED, ...BY_HAND };
const BROUGHT = ["choices", "objects", "sessions", "videos", "materials", "mounts", "calibration"];

/** `#/calibrate?object=ID&way=points&back=...` @param {Visit} visit */
export async function calibrate({ query, signal }) {
  const [choices, objects, sessions, videos, materials, mounts, guide] = await Promise.all(
    BROUGHT.map((what) => api(`/api/${what}`, { signal })),
  );
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
    drawWays(ways, way, now);
    /** @type {Context} */
    const context = {
      ...{ choices, objects, sessions, videos, materials, mounts, guide },
      object: now.get("object"),
      back: now.get("back"),
      signal: AbortSignal.any([signal, inner.signal]),
    };
    put(page, way && WAYS[way]?.[2](context));
  };
  update(query);
  return { title: "Find the mount", node, update };
}

/** @param {HTMLElement} place @param {string | null} current @param {URLSearchParams} query */
function drawWays(place, current, query) {
  const active = document.activeElement;
  const focused = active instanceof HTMLInputElement && active.value === current;
  put(
    place,
    group("Recommended", RECOMMENDED, current, query),
    h(
      "details",
      { open: current !== null && !(current in RECOMMENDED) },
      h("summary", {}, "Other ways"),
      stacked(
        group("Record something else", RECORDED, current, query),
        group("Without a recording", BY_HAND, current, query),
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
