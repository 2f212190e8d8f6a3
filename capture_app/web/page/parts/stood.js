// Say where the person stood when the take began, and have the motion made again from there.
import { freshKey } from "../core/api.js";
import { announce, box, h, inRow, say, stacked } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { attempt, button, number } from "./fields.js";
/** @import {Described, Result} from "../core/answers.js"
 *  @import {Stage} from "./stage.js" */

/** Buttons under the stage of a result that can be made again from its recording; else nothing.
 *  @param {Result} item @param {Stage} stage @param {Described[]} form of a run */
export function stood(item, stage, form) {
  const { manifest } = item;
  const given = manifest.inputs.some(({ role }) => role === "contacts" || role === "body");
  const ours = manifest.options.configuration === "capture" && !manifest.options.weights;
  const able = item.session && !manifest.correction && !given && ours;
  return able ? new Stood(item, stage, form).node : null;
}

// Heights of the balls of a post that is as tall as a person.
const POST = Array.from({ length: 35 }, (_, k) => 0.05 * k);
// Metres from the object's origin: who is farther away does not come in time.
const FARTHEST = 4;
const WHERE = "Click on the floor where the person stood when the take began, or type the place.";

class Stood {
  /** @type {number[] | null} */
  place = null;
  key = "";

  /** @param {Result} item @param {Stage} stage @param {Described[]} form */
  constructor(item, stage, form) {
    this.form = form;
    this.item = item;
    this.stage = stage;
    this.begin = button("They stood elsewhere", () => this.pick());
    this.make = button("Make it again from there", () => this.send(), { class: "main" });
    this.stop = button("Leave it as it is", () => this.finish());
    this.typed = ["x", "y"].map((axis) => number(`Place, ${axis}`, { unit: "m", step: 0.01 }));
    for (const { input } of this.typed) input.addEventListener("input", () => this.typing());
    this.tools = stacked(box("grid", this.typed.map(({ node }) => node)), inRow(this.make, this.stop));
    this.hint = h("p", { class: "hint", role: "status" });
    this.problem = h("div");
    this.node = stacked(inRow(this.begin), this.tools, this.hint, this.problem);
    stage.canvas.addEventListener("click", (event) => this.clicked(event));
    stage.addEventListener("opened", () => this.reset());
    this.reset();
  }

  reset() {
    this.begin.hidden = this.stage.scenes.length !== 1;
    this.tools.hidden = true;
    if (this.stage.picker === this) this.stage.clicksFor(null);
    say(this.hint, "");
  }

  pick() {
    this.begin.hidden = true;
    this.tools.hidden = false;
    this.make.disabled = true;
    for (const { input } of this.typed) input.value = "";
    this.toStart();
    // From above the floor fills the picture.
    this.stage.viewer?.camera("top");
    this.stage.node.scrollIntoView({ block: "start" });
    this.stage.clicksFor(this);
    say(this.hint, WHERE);
  }

  /** Where the place is meant; false if the view was there already. */
  toStart() {
    const { viewer } = this.stage;
    viewer?.pause();
    const moved = viewer !== null && viewer.time > 0;
    if (moved) viewer.seek(0);
    return moved;
  }

  /** The clicks are for something else. */
  letGo() {
    this.stage.mark([]);
    this.reset();
  }

  finish() {
    this.stage.clicksFor(null);
    this.letGo();
    this.begin.focus();
  }

  /** @param {MouseEvent} event */
  clicked(event) {
    if (this.stage.picker !== this || this.stage.dragged(event)) return;
    if (this.toStart()) {
      say(this.hint, "This is how the take begins. Click again.");
      return;
    }
    const place = this.stage.viewer?.floor(event.offsetX, event.offsetY);
    if (!place) {
      say(this.hint, "That is above the horizon. Click on the floor.");
      return;
    }
    for (const [k, { input }] of this.typed.entries()) input.value = place[k].toFixed(2);
    this.put();
  }

  typing() {
    this.toStart();
    this.put();
  }

  /** Take the place that the fields say. */
  put() {
    const place = this.typed.map((one) => one.read() ?? NaN);
    const { viewer } = this.stage;
    const said = viewer !== null && place.every(Number.isFinite);
    const post = said ? POST.map((z) => viewer.fromObject([...place, z])) : [];
    const near = said && Math.hypot(...post[0]) < FARTHEST;
    this.stage.mark(near ? post : []);
    this.make.disabled = !near;
    this.place = near ? place : null;
    this.key = freshKey();
    const far = said ? "That is too far from the object to come in time." : WHERE;
    const told = near ? `They will start at the post, at ${place.join(", ")} m.` : far;
    say(this.hint, told);
    announce(told);
  }

  send() {
    const { item } = this;
    const { manifest } = item;
    const options = Object.fromEntries(this.form.map(({ name }) => [name, manifest.options[name]]));
    return attempt(this.make, this.problem, async () => {
      const json = {
        kind: "run",
        name: `${item.name}, from elsewhere`,
        session: item.session,
        object: item.object,
        // A motion of a phone that names no mount was made in the phone's own frame.
        mount: item.mount ?? (manifest.options.animated ? null : "identity"),
        options: { ...options, stood: this.place, video: Boolean(item.video) },
      };
      await toJob(json, this.key, {});
    });
  }
}
