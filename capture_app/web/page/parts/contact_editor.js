// Correct which hand holds when and where, and have the motion solved again.
import { api } from "../core/api.js";
import { h, say } from "../core/dom.js";
import { announce } from "../core/live.js";
import { go } from "../core/router.js";
import { store, stored } from "../core/stored.js";
import { confirmed } from "./dialog.js";
import { attempt, button } from "./fields.js";
import { freshKey } from "./order_form.js";
/** @import {Segment} from "/static/viewer/pack.js"
 *  @import {Result} from "../core/answers.js"
 *  @import {Stage} from "./stage.js" */

const KEPT = "These are your corrections of last time. Nothing is solved again yet.";
const HELP =
  "Drag a contact on the timeline or its ends; with the keyboard: Tab to it, " +
  "Enter, arrows. “Add” puts one at the playhead. Ctrl-Z undoes, Ctrl-Y redoes.";

/** Buttons under the stage of a result. @param {Result} item @param {Stage} stage */
export function contactEditor(item, stage) {
  const editor = new Editor(item, stage);
  stage.addEventListener("opened", () => editor.attach());
  return editor.node;
}

class Editor {
  /** @type {string | null} */
  key = null;

  /** @param {Result} item @param {Stage} stage */
  constructor(item, stage) {
    this.item = item;
    this.stage = stage;
    this.edit = button("Correct the contacts", () => this.begin());
    this.place = button("Put this hand elsewhere", () => this.pick(!this.picking));
    this.stop = button("Stop correcting", () => this.leave());
    this.solve = button("Solve again", () => this.send(), { class: "main" });
    this.hint = h("p", { class: "hint", role: "status" });
    this.problem = h("div");
    this.tools = h("div", { class: "row" }, this.place, this.solve, this.stop);
    this.node = h(
      "div",
      { class: "stack tight" },
      h("div", { class: "row" }, this.edit),
      this.hint,
      this.tools,
      this.problem,
    );
    stage.canvas.addEventListener("click", (event) => this.clicked(event));
    const { signal } = stage;
    document.addEventListener("keydown", (event) => this.timeline?.undoKey(event), { signal });
    this.reset();
  }

  /** That of the one motion that is shown. */
  get timeline() {
    return this.stage.timelines.at(0);
  }

  /** After a scene was opened. */
  attach() {
    this.timeline?.addEventListener("edit", (event) => {
      if (event instanceof CustomEvent) this.edited(event.detail.segments);
    });
    this.timeline?.addEventListener("select", () => this.refresh());
    this.reset();
    const kept = this.edit.hidden ? null : draft(this.item.id, this.sample);
    if (!kept) return;
    this.begin();
    this.timeline?.restore(kept);
    say(this.hint, KEPT);
  }

  /** Index of the one sample that is shown. */
  get sample() {
    return this.stage.scenes.at(0)?.sample ?? this.item.chosen ?? 0;
  }

  /** Nothing is corrected yet. */
  reset() {
    const editable = this.timeline && this.stage.viewer?.header(0)?.editable;
    this.edit.hidden = this.stage.scenes.length !== 1 || !editable;
    this.tools.hidden = true;
    this.stage.node.classList.remove("correcting");
    this.pick(false);
    say(this.hint, "");
  }

  begin() {
    if (!this.timeline) return;
    this.stage.viewer?.pause();
    this.timeline.editable = true;
    this.edit.hidden = true;
    this.tools.hidden = false;
    this.stage.node.classList.add("correcting");
    this.stage.node.scrollIntoView({ block: "start" });
    say(this.hint, HELP);
    this.refresh();
  }

  /** Stop; what was corrected is thrown away, after it was asked for. */
  async leave() {
    const asked = {
      title: "Throw the corrections away?",
      text: "The contacts become what they were. If you only want to look at something else, go there: the corrections are kept.",
      yes: "Throw them away",
      act: async () => {},
    };
    if (this.timeline?.dirty && !(await confirmed(asked))) return;
    this.timeline?.reset();
    forget(this.item.id, this.sample);
    this.finish();
  }

  finish() {
    if (this.timeline) this.timeline.editable = false;
    this.stage.viewer?.contacts(0, null);
    this.reset();
    this.edit.focus();
  }

  /** @param {Segment[]} segments */
  edited(segments) {
    this.stage.viewer?.contacts(0, segments);
    this.key = null;
    if (this.timeline?.dirty) keep(this.item.id, this.sample, segments);
    else forget(this.item.id, this.sample);
    this.refresh();
  }

  refresh() {
    const selected = this.timeline?.selected;
    this.solve.disabled = !this.timeline?.dirty;
    this.place.disabled = !selected;
    if (!selected) this.pick(false);
  }

  get picking() {
    return this.stage.picker === this;
  }

  /** @param {boolean} on */
  pick(on) {
    if (on || this.picking) this.stage.clicksFor(on ? this : null);
    this.letGo(on);
    if (on) say(this.hint, "Click the place on the object where this hand holds.");
  }

  /** The clicks are for something else. */
  letGo(on = false) {
    if (!on && !this.tools.hidden) say(this.hint, HELP);
    this.place.setAttribute("aria-pressed", String(on));
  }

  /** @param {MouseEvent} event */
  clicked(event) {
    if (!this.picking || this.stage.dragged(event)) return;
    const hit = this.stage.viewer?.pick(event.offsetX, event.offsetY);
    if (!hit) {
      say(this.hint, "That is beside the object. Click on it.");
      return;
    }
    this.timeline?.setAnchor(hit);
    this.pick(false);
    say(this.hint, "The hand will hold there.");
    announce("The hand will hold there.");
  }

  send() {
    const key = (this.key ??= freshKey());
    return attempt(this.solve, this.problem, async () => {
      const name = `${this.item.name}, corrected`;
      const video = Boolean(this.item.video ?? this.item.video_job);
      const json = {
        kind: "resolve",
        name,
        result: this.item.id,
        contacts: this.timeline?.contacts,
        sample: this.sample + 1,
        video,
      };
      const job = await api("/api/jobs", { json, headers: { "Idempotency-Key": key } });
      forget(this.item.id, this.sample);
      go(`#/jobs/${job.id}`);
    });
  }
}

// Corrections that are not solved yet are kept in the browser until they are, or thrown away.

/** @param {string} result @param {number} sample */
const draftName = (result, sample) => `contacts of ${result}, sample ${sample}`;

/** Those of a sample of a result; null for none.
 *  @param {string} result @param {number} sample @returns {Segment[] | null} */
function draft(result, sample) {
  const found = stored(localStorage, draftName(result, sample));
  return Array.isArray(found) ? found : null;
}

/** @param {string} result @param {number} sample @param {Segment[]} segments */
function keep(result, sample, segments) {
  store(localStorage, draftName(result, sample), segments);
}

/** @param {string} result @param {number} sample */
function forget(result, sample) {
  store(localStorage, draftName(result, sample), null);
}
