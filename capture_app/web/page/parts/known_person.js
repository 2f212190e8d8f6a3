// Say where the person was and which hands hold, and have the motion made again so.
import { freshKey } from "../core/api.js";
import { announce, box, h, inRow, say, stacked } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { attempt, button, choice, number } from "./fields.js";
/** @import {Described, Result} from "../core/answers.js"
 *  @import {Stage} from "./stage.js" */

/** Buttons under the stage of a result that can be made again from its recording; else nothing.
 *  @param {Result} item @param {Stage} stage @param {Described[]} form of a run */
export function knownPerson(item, stage, form) {
  const { manifest } = item;
  const given = manifest.inputs.some(({ role }) => role === "contacts" || role === "body");
  const ours = manifest.options.configuration === "capture" && !manifest.options.weights;
  const able = item.session && !manifest.correction && !given && ours;
  return able ? new KnownPerson(item, stage, form).node : null;
}

// Heights of the balls of a post that is as tall as a person.
const POST = Array.from({ length: 35 }, (_, k) => 0.05 * k);
// Metres from the object's origin: who is farther away does not come in time.
const FARTHEST = 4;
/** When the place is meant, by the option that says it: words for it, and what will be there.
 *  @type {Record<string, [string, string]>} */
const MOMENTS = {
  stood: ["as the take begins", "They will start at the post"],
  side: ["while they hold it", "They will hold it from the side of the post"],
  ends: ["as the take ends", "They will end at the post"],
};
const WHERE = "Click on the floor where the person was, or type the place.";
/** @typedef {keyof typeof MOMENTS} Moment */

class KnownPerson {
  /** Places on the floor by moment. @type {Record<string, number[]>} */
  places = {};
  key = "";

  /** @param {Result} item @param {Stage} stage @param {Described[]} form */
  constructor(item, stage, form) {
    this.form = form;
    this.item = item;
    this.stage = stage;
    this.begin = button("They stood elsewhere", () => this.pick());
    this.make = button("Make it again from there", () => this.send(), { class: "main" });
    this.other = button("The other side", () => this.mirror());
    this.stop = button("Leave it as it is", () => this.finish());
    this.when = choice("The place is where they were", Object.entries(MOMENTS).map(([key, [words]]) => [key, words]));
    this.when.input.addEventListener("change", () => this.turned());
    this.typed = ["x", "y"].map((axis) => number(`Place, ${axis}`, { unit: "m", step: 0.01 }));
    for (const { input } of this.typed) input.addEventListener("input", () => this.typing());
    const hands = form.find(({ name }) => name === "hands");
    this.hands = choice(hands?.title ?? "", hands?.options ?? []);
    this.tools = stacked(
      box("grid", [this.when, ...this.typed, this.hands].map(({ node }) => node)),
      inRow(this.make, this.other, this.stop),
    );
    this.tools.addEventListener("change", () => this.ready());
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
    this.places = {};
    this.hands.input.value = this.handsBefore();
    this.turned();
    // From above the floor fills the picture.
    this.stage.viewer?.camera("top");
    this.stage.node.scrollIntoView({ block: "start" });
    this.stage.clicksFor(this);
  }

  /** Another moment is chosen: its place stands in the fields. */
  turned() {
    const place = this.places[this.when.read()];
    for (const [k, { input }] of this.typed.entries()) input.value = place ? place[k].toFixed(2) : "";
    this.toMoment();
    this.put();
  }

  /** Where the place is meant; false if the view was there already. */
  toMoment() {
    const { viewer } = this.stage;
    if (!viewer) return false;
    viewer.pause();
    const times = { stood: 0, side: viewer.heldAt(), ends: viewer.duration };
    const time = times[/** @type {keyof typeof times} */ (this.when.read())];
    const moved = Math.abs(viewer.time - time) > 1e-3;
    if (moved) viewer.seek(time);
    return moved;
  }

  /** They held it from the opposite side of the object. */
  mirror() {
    this.when.input.value = "side";
    this.toMoment();
    const place = this.stage.viewer?.opposite();
    if (place) this.say(place);
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
    if (this.toMoment()) {
      say(this.hint, `This is ${MOMENTS[this.when.read()][0]}. Click again.`);
      return;
    }
    const place = this.stage.viewer?.floor(event.offsetX, event.offsetY);
    if (place) this.say(place);
    else say(this.hint, "That is above the horizon. Click on the floor.");
  }

  /** Write a place into the fields, and take it. @param {number[]} place */
  say(place) {
    for (const [k, { input }] of this.typed.entries()) input.value = place[k].toFixed(2);
    this.put();
  }

  typing() {
    this.toMoment();
    this.put();
  }

  /** Take the place that the fields say. */
  put() {
    const moment = this.when.read();
    const place = this.typed.map((one) => one.read() ?? NaN);
    const { viewer } = this.stage;
    const said = viewer !== null && place.every(Number.isFinite);
    const post = said ? POST.map((z) => viewer.fromObject([...place, z])) : [];
    const near = said && Math.hypot(...post[0]) < FARTHEST;
    this.stage.mark(near ? post : []);
    delete this.places[moment];
    if (near) this.places[moment] = place;
    this.ready();
    const far = said ? "That is too far from the object to come in time." : WHERE;
    const told = near ? `${MOMENTS[moment][1]}, at ${place.join(", ")} m.` : far;
    say(this.hint, told);
    announce(told);
  }

  handsBefore() {
    return String(this.item.manifest.options.hands ?? "auto");
  }

  /** It can be made again once anything is said anew. */
  ready() {
    const other = this.hands.read() !== this.handsBefore();
    this.make.disabled = !other && Object.keys(this.places).length === 0;
    this.key = freshKey();
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
        options: { ...options, ...this.places, hands: this.hands.read(), video: Boolean(item.video) },
      };
      await toJob(json, this.key, {});
    });
  }
}
