// Parts of the replay page around the picture: cameras, layers, choices, report.

import { clock, element } from "./elements.js";
import { TINTS } from "./palette.js";
import { isPlaced, toldOf } from "./reports.js";
import { LAYERS, camerasOf } from "./words.js";
/** @import {Check, Header} from "./pack.js"
 *  @import {Placed} from "./reports.js"
 *  @import {Viewer} from "./viewer.js" */

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

/** @param {Element} host @param {Viewer} viewer @param {Header} header */
export function cameraButtons(host, viewer, header) {
  const there = camerasOf(header);
  const buttons = there.map(([mode, text]) =>
    element("button", { type: "button", text, onclick: () => viewer.camera(mode) }),
  );
  const mark = () =>
    buttons.forEach((button, k) =>
      button.setAttribute("aria-pressed", String(there[k][0] === viewer.cameraMode)),
    );
  host.replaceChildren(...buttons);
  viewer.addEventListener("camera", mark);
  mark();
}

/** @param {Element} host @param {Viewer} viewer @param {Header} header */
export function layerBoxes(host, viewer, header) {
  /** @type {Record<string, string>} */
  const needed = {
    body: "root",
    contacts: "root",
    object: "object_vertices",
    trail: "object_vertices",
    phone: "phone_position",
    path: "phone_position",
  };
  const there = Object.entries(LAYERS).filter(([name]) => !needed[name] || needed[name] in header.arrays);
  host.replaceChildren(
    ...there.map(([name, text]) => {
      const box = element("input", {
        type: "checkbox",
        onchange: () => viewer.show({ [name]: box.checked }),
      });
      box.checked = viewer.layers[name];
      return element("label", { class: "tick" }, [box, text]);
    }),
  );
}

/** @param {HTMLSelectElement} select @param {Viewer} viewer */
export function speedChoice(select, viewer) {
  select.replaceChildren(...SPEEDS.map((s) => element("option", { value: s, text: `${s}×` })));
  select.value = "1";
  select.addEventListener("change", () => (viewer.speed = Number(select.value)));
}

/** @param {Element} host @param {Viewer} viewer @param {(string | undefined)[]} names */
export function paneNames(host, viewer, names) {
  host.replaceChildren(
    ...viewer.panes().map(({ slot, x }, k, all) => {
      const dot = element("i");
      const color = TINTS[slot % TINTS.length].body.map((c) => Math.round(255 * c));
      dot.style.background = `rgb(${color.join(" ")})`;
      const name = element("span", {}, [dot, names[slot] ?? ""]);
      name.style.left = `${x + 12}px`;
      if (all.every((pane) => pane.x === all[0].x)) name.style.top = `${0.6 + 2.1 * k}rem`;
      return name;
    }),
  );
}

/** The report, the faults of a sample and the notes; `chosen(event)` hears which place was clicked.
 *  @param {HTMLElement} host @param {Header} header @param {number} sample
 *  @param {(check: Placed) => void} chosen */
export function reportPanel(host, header, sample, chosen) {
  const { report, events, faults, notes } = header;
  /** @type {HTMLElement[][]} */
  const parts = [];
  /** @param {Check[]} checks */
  const items = (checks) => checks.map((check) => item(check, header, chosen));
  if (report) parts.push(titled(`Recording: ${report.verdict}`, items(events)));
  if (faults[sample]?.length) parts.push(titled("Motion", items(faults[sample])));
  if (notes.length) {
    parts.push(titled("Good to know", notes.map((text) => element("li", { text }))));
  }
  host.replaceChildren(...parts.flat());
  host.hidden = !toldOf(header, sample).length && !notes.length;
}

/** @param {Element} host @param {Check} event */
export function markItem(host, event) {
  for (const button of /** @type {NodeListOf<HTMLElement>} */ (host.querySelectorAll(".item"))) {
    const current = button.dataset.at === keyOf(event);
    button.setAttribute("aria-current", String(current));
    if (current) button.scrollIntoView({ block: "nearest" });
  }
}

/** @param {string} text @param {HTMLElement[]} items */
function titled(text, items) {
  return [element("h2", { text }), element("ul", {}, items)];
}

/** @param {Check} event @param {Header} header @param {(check: Placed) => void} chosen */
function item(event, { fps }, chosen) {
  const placed = isPlaced(event) ? event : null;
  const at = placed ? clock(placed.start / fps) : "whole take";
  const button = element("button", {
    type: "button",
    class: `item ${event.severity}`,
    "data-at": keyOf(event),
    disabled: !placed,
    onclick: () => placed && chosen(placed),
  });
  button.append(element("b", { text: `${event.name} (${at})` }), event.message);
  if (event.fix) button.append(element("span", { class: "fix", text: event.fix }));
  return element("li", {}, [button]);
}

/** @param {Check} event */
function keyOf(event) {
  return `${event.name} ${event.start}`;
}
