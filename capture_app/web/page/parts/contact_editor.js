// Correct which hand holds when and where, and have the motion solved again.
import { freshKey } from "../core/api.js";
import { box, h, inRow, say } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { store, stored } from "../core/stored.js";
import { confirmed } from "./dialog.js";
import { attempt, button, describedFields, grid, saidIn, tick } from "./fields.js";
import { grips } from "./grips.js";
import { Trial } from "./trial.js";
/** @import {Segment} from "/static/viewer/pack.js"
 *  @import {Described, Result} from "../core/answers.js"
 *  @import {Stage} from "./stage.js" */

const KEPT = "These are your corrections of last time.";
const HELP =
  "Drag a hand's ring over the object, or a contact on the timeline or its ends; with the keyboard: Tab to " +
  "it, then arrows. “Add” puts a contact at the playhead. Ctrl-Z undoes, Ctrl-Y redoes.";
const ITSELF = "contacts are solved by themselves";

/** Buttons under the stage of a result.
 *  @param {Result} item @param {Stage} stage @param {Described[]} form of what makes another motion */
export function contactEditor(item, stage, form) {
  const editor = new Editor(item, stage, form);
  stage.addEventListener("opened", () => editor.attach());
  return editor.node;
}

class Editor {
  /** What is said before all else: that corrections are older. */
  before = "";
  /** @type {string | null} */
  key = null;

  /** @param {Result} item @param {Stage} stage @param {Described[]} form */
  constructor(item, stage, form) {
    const video = Boolean(item.video ?? item.video_job);
    this.options = describedFields(form.map((one) => (one.name === "video" ? { ...one, value: video } : one)));
    this.item = item;
    this.stage = stage;
    this.edit = button("Correct the contacts", () => this.begin());
    this.stop = button("Stop correcting", () => this.leave());
    this.solve = button("Keep it as a new motion", () => this.send(), { class: "main" });
    this.itself = tick("Solve after each correction", { checked: stored(localStorage, ITSELF) ?? true });
    this.itself.input.addEventListener("change", () => this.switched());
    this.hint = h("p", { class: "hint", role: "status" });
    this.problem = h("div");
    this.tools = inRow(this.solve, this.stop, this.itself.node, grid(this.options));
    this.node = box("stack tight", inRow(this.edit), this.hint, this.tools, this.problem);
    this.trial = new Trial(item.id, stage, (words) => say(this.hint, `${this.before}${words}`));
    grips(stage, () => this.able, () => this.begin({ quiet: true }));
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
    this.trial.attach();
    this.reset();
    const kept = this.edit.hidden ? null : draft(this.item.id, this.sample);
    if (!kept) return;
    this.begin();
    this.timeline?.restore(kept);
    this.before = `${KEPT} `;
    say(this.hint, KEPT);
  }

  /** Index of the one sample that is shown. */
  get sample() {
    return this.stage.scenes.at(0)?.sample ?? this.item.chosen ?? 0;
  }

  /** Whether what is shown can be corrected. */
  get able() {
    return this.stage.scenes.length === 1 && Boolean(this.timeline && this.stage.viewer?.header(0)?.editable);
  }

  /** Nothing is corrected yet. */
  reset() {
    this.edit.hidden = !this.able;
    this.tools.hidden = true;
    this.stage.node.classList.remove("correcting");
    say(this.hint, "");
  }

  /** `quiet`: where the work is stays where it is. */
  begin({ quiet = false } = {}) {
    if (!this.timeline || this.edit.hidden) return;
    this.stage.viewer?.pause();
    this.timeline.editable = true;
    this.edit.hidden = true;
    this.tools.hidden = false;
    this.stage.node.classList.add("correcting");
    say(this.hint, HELP);
    // What was just done in the picture stays in sight, and what can be done with it comes into it.
    if (quiet) for (const one of [this.tools, this.stage.frame]) one.scrollIntoView({ block: "nearest" });
    else this.stage.node.scrollIntoView({ block: "start" });
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
    this.trial.revert();
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
    this.before = "";
    this.stage.viewer?.contacts(0, segments);
    this.key = null;
    if (this.timeline?.dirty) keep(this.item.id, this.sample, segments);
    else forget(this.item.id, this.sample);
    this.refresh();
    this.trySoon();
  }

  /** Have the motion solved again, if that is wanted. */
  trySoon() {
    const order = () => ({ contacts: this.timeline?.contacts, sample: this.sample + 1 });
    if (!this.timeline?.dirty) this.trial.revert();
    else if (this.itself.read()) this.trial.soon(order);
  }

  /** Whether it is wanted is another. */
  switched() {
    store(localStorage, ITSELF, this.itself.read());
    if (this.itself.read()) this.trySoon();
    else this.trial.stop();
  }

  refresh() {
    this.solve.disabled = !this.timeline?.dirty;
  }

  send() {
    const key = (this.key ??= freshKey());
    this.trial.stop();
    return attempt(this.solve, this.problem, async () => {
      const name = `${this.item.name}, corrected`;
      const json = {
        kind: "resolve",
        name,
        result: this.item.id,
        contacts: this.timeline?.contacts,
        sample: this.sample + 1,
        ...saidIn(this.options),
      };
      await toJob(json, key, {});
      forget(this.item.id, this.sample);
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
