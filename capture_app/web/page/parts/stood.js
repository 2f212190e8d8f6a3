// Say where the person stood when the take began, and have the motion made again from there.
import { api } from "../core/api.js";
import { h, say } from "../core/dom.js";
import { announce } from "../core/live.js";
import { go } from "../core/router.js";
import { attempt } from "./fields.js";
import { freshKey } from "./order_form.js";

// Options that a result is made again with.
const REPEATED = [
  "samples",
  "seed",
  "steps",
  "height",
  "contact",
  "segment",
  "floor",
  "up",
  "stitch",
  "closure",
  "force",
];

/** Buttons under the stage of a result that can be made again from its recording; else nothing. */
export function stood(item, stage) {
  const { manifest } = item;
  const given = manifest.inputs.some(({ role }) => role === "contacts" || role === "body");
  const ours = manifest.options.configuration === "capture" && !manifest.options.weights;
  const able = item.session && !manifest.correction && !given && ours;
  return able ? new Stood(item, stage).node : null;
}

class Stood {
  constructor(item, stage) {
    Object.assign(this, { item, stage, place: null });
    const button = (words, click, more) =>
      h("button", { type: "button", on: { click }, ...more }, words);
    this.begin = button("They stood elsewhere", () => this.pick());
    this.make = button("Make it again from there", () => this.send(), { class: "main" });
    this.stop = button("Leave it as it is", () => this.finish());
    this.tools = h("div", { class: "row" }, this.make, this.stop);
    this.hint = h("p", { class: "hint", role: "status" });
    this.problem = h("div");
    this.node = h(
      "div",
      { class: "stack" },
      h("div", { class: "row" }, this.begin),
      this.tools,
      this.hint,
      this.problem,
    );
    stage.canvas.addEventListener("click", (event) => this.clicked(event));
    stage.addEventListener("opened", () => this.reset());
    this.reset();
  }

  reset() {
    this.place = null;
    const opened = this.stage.scenes?.length === 1;
    this.begin.hidden = !opened;
    this.tools.hidden = true;
    if (this.stage.picker === this) this.stage.clicksFor(null);
    say(this.hint, "");
  }

  pick() {
    this.begin.hidden = true;
    this.tools.hidden = false;
    this.make.disabled = true;
    this.stage.viewer.pause();
    this.stage.viewer.seek(0);
    this.stage.clicksFor(this);
    say(this.hint, "Click on the floor where the person stood when the take began.");
  }

  /** Something else wants the clicks. */
  letGo() {
    this.stage.mark([]);
    this.reset();
  }

  finish() {
    this.stage.clicksFor(null);
    this.letGo();
    this.begin.focus();
  }

  clicked(event) {
    if (this.stage.picker !== this) return;
    this.stage.viewer.seek(0);
    const hit = this.stage.viewer.floor(event.offsetX, event.offsetY);
    if (!hit) return say(this.hint, "That is above the horizon. Click on the floor.");
    this.place = hit.place.slice(0, 2).map((metres) => Number(metres.toFixed(2)));
    this.stage.mark([hit.point_object]);
    this.make.disabled = false;
    const told = `They will start at the ball, at ${this.place.join(", ")} m.`;
    say(this.hint, told);
    announce(told);
  }

  send() {
    const { item } = this;
    const { manifest } = item;
    const options = Object.fromEntries(REPEATED.map((key) => [key, manifest.options[key]]));
    return attempt(this.make, this.problem, async () => {
      const json = {
        kind: "run",
        name: `${item.name}, from elsewhere`,
        session: item.session,
        object: item.object,
        mount: item.mount,
        options: { ...options, stood: this.place, video: Boolean(item.video) },
      };
      const job = await api("/api/jobs", { json, headers: { "Idempotency-Key": freshKey() } });
      go(`#/jobs/${job.id}`);
    });
  }
}
