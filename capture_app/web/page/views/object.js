// A stored object: to look at, its size, its unit.
import { api } from "../core/api.js";
import { announce, box, factList, folded, goTo, h, inRow, put, stacked } from "../core/dom.js";
import { itemHead, useIt } from "../core/library.js";
import { address } from "../core/router.js";
import { sides } from "../core/words.js";
import { checkList } from "../parts/checks.js";
import { choice, doing } from "../parts/fields.js";
import { Stage } from "../parts/stage.js";
/** @import {Thing} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js" */

const UNITS = [["1", "metres"], ["0.01", "centimetres"], ["0.001", "millimetres"], ["0.0254", "inches"]];

/** `#/objects/ID?back=...` @param {Visit} visit */
export async function object({ params, query, signal }) {
  const path = `/api/objects/${params.id}`;
  /** @type {Thing} */
  const item = await api(path, { signal });
  const stage = new Stage({ label: `The object ${item.name} in 3D`, signal, controls: false });
  const facts = h("div");
  const show = () => {
    put(facts, told(item));
    stage.open([{ url: `${path}/scene`, name: item.name }]);
  };
  show();
  const node = box(
    "stack wide",
    itemHead("objects", item, ""),
    box(
      "split",
      stage.node,
      stacked(
        facts,
        unit(item, path, show),
        goTo(address("/calibrate", { object: item.id }), "Find where the phone sits on it"),
        useIt("object", item, query.get("back")),
      ),
    ),
    scanned(item, path),
  );
  return { title: item.name, node };
}

/** @param {Thing} item */
function told(item) {
  const facts = [
    ["Size", sides(item.extents)],
    ["Triangles", item.faces.toLocaleString("en")],
    ["Corners", item.vertices.toLocaleString("en")],
  ];
  return [factList(facts), item.warnings.length > 0 && box("note", item.warnings.map((text) => h("p", {}, text)))];
}

/** How good the scan is that it was made by. @param {Thing} item @param {string} path */
function scanned(item, path) {
  if (!item.scan) return null;
  /** @param {string} name @param {string} alt */
  const picture = (name, alt) => {
    const shown = h("img", {
      src: `${path}/scan/${name}`,
      alt,
      loading: "lazy",
      class: "film",
      // A mesh of another app has no film.
      on: { error: () => shown.remove() },
    });
    return shown;
  };
  return h(
    "section",
    { class: "stack" },
    h("h2", {}, "The scan"),
    h("div", { class: `verdict ${item.scan.severity}` }, h("p", { class: "verdict-words" }, SCANS[item.scan.severity])),
    checkList(item.scan.checks),
    picture("views.png", "The mesh from four sides, in its colours and its shape alone"),
    picture("outline.png", "Its outline, and the box it was looked for in, on pictures of the film"),
    h(
      "p",
      {},
      h(
        "a",
        { href: `${path}/scan/report.html`, target: "_blank", rel: "noopener" },
        "Report with all numbers, to print or send (new tab)",
      ),
    ),
  );
}

const SCANS = {
  ok: "This scan is good",
  warn: "This scan is usable with limits",
  bad: "This scan is not usable as it is",
};

/** @param {Thing} item @param {string} path @param {() => void} show */
function unit(item, path, show) {
  const problem = h("div");
  const other = !UNITS.some(([key]) => Number(key) === item.scale);
  const units = choice(
    "Unit of the mesh's file",
    [...UNITS, ...(other ? [[String(item.scale), `${item.scale} m`]] : [])],
    { value: String(item.scale) },
  );
  const keep = doing(
    "Change the unit",
    async () => {
      Object.assign(item, await api(path, { method: "PATCH", json: { scale: Number(units.read()) } }));
      show();
      announce(`The object is now ${sides(item.extents)}.`);
    },
    { place: problem },
  );
  return folded("The size is wrong", stacked(units.node, inRow(keep), problem));
}
