// Named points, each clicked on the object in 3D or typed.
import { announce, box, folded, h, inRow, put, say, stacked } from "../core/dom.js";
import { choice, number } from "./fields.js";
import { Stage } from "./stage.js";

/** A point that was placed, in metres. @typedef {{name: string, at: number[]}} Point */
/** @typedef {{names: string[], enough: number, label: string, signal: AbortSignal,
 *    words: (now: {chosen: string, left: number}) => string, what?: string,
 *    scene?: (id: string) => string, picture?: ((name: string) => Node) | null}} Asked */

/** `names` of the points; `enough`: so many are needed; `label` of the choice between them; `what` they
 *  are on, which is packed by the server at the address `scene(id)`.
 *  `words({chosen, left})` -> what to do next; `picture(name)` -> a drawing of it, if there is one. */
export class PointPicker extends EventTarget {
  /** @type {Point[]} */
  points = [];
  /** @type {string | null} */
  object = null;

  /** @param {Asked} asked */
  constructor({
    names,
    enough,
    label,
    words,
    what = "object",
    scene = (id) => `/api/objects/${id}/scene`,
    picture = null,
    signal,
  }) {
    super();
    this.what = what;
    this.scene = scene;
    this.names = names;
    this.enough = enough;
    this.words = words;
    this.drawing = picture;
    this.stage = new Stage({ label: `The ${what} in 3D. Click where the point is`, signal, controls: false });
    const { canvas } = this.stage;
    canvas.classList.add("picking");
    canvas.addEventListener("click", (event) => this.clicked(event));
    this.status = h("p", { class: "hint", role: "status" });
    this.point = choice(label, names.map((name) => [name, name]));
    this.point.input.addEventListener("change", () => this.refresh());
    this.picture = h("div");
    this.list = h("ol", { class: "pairs" });
    this.typed = ["x", "y", "z"].map((axis) => number(axis, { unit: "cm" }));
    this.content = stacked(
      names.length > 1 && box("row beside", picture && this.picture, this.point.node),
      this.list,
      this.byHand(),
    );
  }

  /** Points by keyboard, for who cannot click or has measured. */
  byHand() {
    const add = h(
      "button",
      {
        type: "button",
        on: { click: () => this.add(this.typed.map((one) => (one.read() ?? 0) / 100)) },
      },
      "Add this point",
    );
    return folded("Type the place instead of clicking", box("grid", this.typed.map((one) => one.node)), inRow(add));
  }

  /** Begin anew on this object, or on none. @param {string | null} id */
  show(id) {
    this.object = id;
    this.points = [];
    this.stage.node.hidden = !id;
    if (id) this.stage.open([{ url: this.scene(id), name: this.what }]);
    this.refresh();
  }

  /** @param {MouseEvent} event */
  clicked(event) {
    if (this.stage.dragged(event)) return;
    const hit = this.stage.viewer?.pick(event.offsetX, event.offsetY);
    if (hit) this.add(hit.point_object);
    else say(this.status, `That is beside the ${this.what}. Drag to turn it, click on its surface.`);
  }

  /** @param {number[]} at */
  add(at) {
    const name = this.point.read();
    this.points = [...this.points.filter((one) => one.name !== name), { name, at: [...at] }];
    const free = this.names.find((other) => !this.points.some((one) => one.name === other));
    if (free) this.point.input.value = free;
    announce(`${name} is placed.`);
    this.refresh();
  }

  /** @param {Point} point */
  remove(point) {
    this.points = this.points.filter((one) => one !== point);
    this.point.input.value = point.name;
    this.refresh();
    this.point.input.focus();
  }

  refresh() {
    if (this.drawing) put(this.picture, this.drawing(this.point.read()));
    put(this.list, this.points.map((point) => this.row(point)));
    this.stage.mark(this.points.map((point) => point.at));
    const left = this.enough - this.points.length;
    say(this.status, this.object ? this.words({ chosen: this.point.read(), left }) : `Choose the ${this.what}.`);
    this.dispatchEvent(new Event("change"));
  }

  /** @param {Point} point */
  row(point) {
    const remove = h(
      "button",
      {
        type: "button",
        class: "quiet",
        "aria-label": `Remove ${point.name}`,
        on: { click: () => this.remove(point) },
      },
      "Remove",
    );
    const place = `${point.at.map((x) => (100 * x).toFixed(1)).join(", ")} cm`;
    return h("li", {}, h("span", {}, point.name), h("span", { class: "hint figures" }, place), remove);
  }
}
