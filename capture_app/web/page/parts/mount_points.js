// The mount by points: each a point of the phone, clicked where it was on the object.
import { h, put, say } from "../core/dom.js";
import { announce } from "../core/live.js";
import { choice, number } from "./fields.js";
import { mountForm, objectField, phoneFields } from "./mount_form.js";
import { phonePicture } from "./phone_picture.js";
import { Stage } from "./stage.js";

const ENOUGH = 3;

export function pointsForm(context) {
  const pairs = new Pairs(context);
  return h(
    "div",
    { class: "split" },
    h("div", { class: "stack" }, pairs.stage.node, pairs.status),
    h(
      "section",
      { class: "card" },
      mountForm({
        back: context.back,
        name: "Mount by points",
        content: pairs.content,
        read: () => pairs.read(),
      }),
    ),
  );
}

/** Corners are easy to see, and far apart. */
function cornersFirst(names) {
  const corner = (name) => Number(/^(top|bottom) (left|right)/.test(name));
  return [...names].sort((a, b) => corner(b) - corner(a));
}

class Pairs {
  constructor({ choices, objects, object, signal }) {
    Object.assign(this, { points: cornersFirst(choices.phone_points), pairs: [] });
    this.stage = new Stage({
      label: "The object in 3D. Click where the point of the phone is",
      signal,
      controls: false,
    });
    this.stage.canvas.classList.add("picking");
    this.stage.canvas.addEventListener(
      "pointerdown",
      (event) => (this.down = [event.offsetX, event.offsetY]),
    );
    this.stage.canvas.addEventListener("click", (event) => this.clicked(event));
    this.status = h("p", { class: "hint", role: "status" });
    this.thing = objectField(objects, object, (id) => this.show(id));
    this.phone = phoneFields(choices.phones);
    this.point = choice(
      "This point of the phone",
      this.points.map((name) => [name, name]),
    );
    this.point.input.addEventListener("change", () => this.refresh());
    this.picture = h("div");
    this.list = h("ol", { class: "pairs" });
    this.typed = ["x", "y", "z"].map((axis) => number(axis, { unit: "cm", step: 0.1 }));
    this.content = h(
      "div",
      { class: "stack" },
      this.thing.node,
      this.phone.node,
      h("div", { class: "row beside" }, this.picture, this.point.node),
      this.list,
      this.byHand(),
    );
    this.show(object);
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
    return h(
      "details",
      {},
      h("summary", {}, "Type the place instead of clicking"),
      h(
        "div",
        { class: "grid" },
        this.typed.map((one) => one.node),
      ),
      h("div", { class: "row" }, add),
    );
  }

  show(id) {
    this.pairs = [];
    this.stage.node.hidden = !id;
    if (id) this.stage.open([{ url: `/api/objects/${id}/scene`, name: "object" }]);
    this.refresh();
  }

  clicked(event) {
    // The end of a drag that turned the view is no click on a point.
    if (Math.hypot(event.offsetX - this.down[0], event.offsetY - this.down[1]) > 4) return;
    const hit = this.stage.viewer?.pick(event.offsetX, event.offsetY);
    if (hit) this.add(hit.point_object);
    else say(this.status, "That is beside the object. Drag to turn it, click on its surface.");
  }

  add(point) {
    const phone = this.point.read();
    this.pairs = [
      ...this.pairs.filter((pair) => pair.phone !== phone),
      { phone, point: [...point] },
    ];
    const free = this.points.find((name) => !this.pairs.some((pair) => pair.phone === name));
    if (free) this.point.input.value = free;
    announce(`${phone} is placed.`);
    this.refresh();
  }

  remove(pair) {
    this.pairs = this.pairs.filter((one) => one !== pair);
    this.point.input.value = pair.phone;
    this.refresh();
    this.point.input.focus();
  }

  refresh() {
    put(this.picture, phonePicture(this.point.read()));
    put(
      this.list,
      this.pairs.map((pair) =>
        h(
          "li",
          {},
          h("span", {}, pair.phone),
          h(
            "span",
            { class: "hint figures" },
            `${pair.point.map((x) => (100 * x).toFixed(1)).join(", ")} cm`,
          ),
          h(
            "button",
            {
              type: "button",
              class: "quiet",
              "aria-label": `Remove ${pair.phone}`,
              on: { click: () => this.remove(pair) },
            },
            "Remove",
          ),
        ),
      ),
    );
    this.stage.mark(this.pairs.map((pair) => pair.point));
    say(this.status, this.words());
  }

  words() {
    if (!this.thing.read()) return "Choose the object.";
    const left = ENOUGH - this.pairs.length;
    if (left > 0)
      return `Click where the phone's “${this.point.read()}” is on the object. ${left} more at least.`;
    if (left === 0) return "Enough to try. One or two more, far from the others, show mistakes.";
    return "Good. Keep this mount, or add more points.";
  }

  read() {
    return {
      method: "points",
      object: this.thing.read(),
      ...this.phone.read(),
      pairs: this.pairs,
      sigma_mm: 2,
    };
  }
}
