// A calibration by recordings: what to do, what to bring, each thing looked at as it comes, one button.
import { freshKey, missing } from "../core/api.js";
import { h, hintLine, inRow, numbered, stacked } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { sends } from "../parts/fields.js";
import { objectField } from "../parts/mount_form.js";
/** @import {Choices, Guide, Item, Mount, Session, Thing} from "../core/answers.js"
 *  @import {Child} from "../core/dom.js"
 *  @import {Choice} from "../parts/fields.js" */

/** What the forms of the ways are made of, and for.
 *  @typedef {{choices: Choices, objects: Thing[], sessions: Session[], videos: Item[],
 *    materials: Item[], mounts: Mount[], guide: Guide, object: string | null, back: string | null,
 *    signal: AbortSignal}} Context */
/** @typedef {{title: string, content: Child[]}} Part */
/** What of a way is its own; `read()` gives the order without kind, name and object.
 *  @typedef {{name: string, parts: Part[], read: () => Record<string, unknown>,
 *    show?: (object: string | null) => void}} Way */

/** A form of numbered parts. @param {(context: Context, thing: Choice) => Way} build */
export function recordedForm(build) {
  return (/** @type {Context} */ context) => {
    const { objects, object, back } = context;
    const thing = objectField(objects, object, (id) => made.show?.(id));
    const made = build(context, thing);
    const name = h("input", { value: made.name, maxlength: 120, required: true });
    const problem = h("div");
    const button = h("button", { type: "submit", class: "main large" }, "Find the mount");
    const key = freshKey();
    const submit = async () => {
      const json = { kind: "calibrate", name: name.value.trim(), object: thing.read(), ...made.read() };
      refuseMissing(json);
      await toJob(json, key, { from: location.hash, back });
    };
    const parts = [
      { title: "The object", content: [thing.node, meshHint()] },
      ...made.parts,
      {
        title: "The mount",
        content: [h("label", { class: "field" }, h("span", {}, "Name of the mount"), name), inRow(button), problem],
      },
    ];
    made.show?.(object);
    return h(
      "form",
      { class: "stack wide", ...sends(button, problem, submit) },
      parts.map(({ title, content }, at) => numbered(at + 1, title, stacked(content))),
    );
  };
}

const NEEDED = {
  object: "the object",
  session: "the recording",
  film: "the film",
  photos: "the photos",
  poses: "the tracker's log",
  scan: "the mesh of the recording",
  mount: "the mount so far",
};

/** Say what is still to be brought, before anything is sent.
 *  @param {{place?: {points: unknown[]}, [key: string]: unknown}} order */
function refuseMissing(order) {
  const lacking = Object.entries(NEEDED)
    .filter(([key]) => key in order && !order[key])
    .map(([, words]) => words);
  if (order.place && order.place.points.length < 3) lacking.push("three corners of the board");
  if (!lacking.length) return;
  throw missing(`Still missing: ${lacking.join(", ")}.`);
}

function meshHint() {
  return hintLine(
    "Not there yet? ",
    h("a", { href: "#/" }, "Bring its mesh"),
    " or ",
    h("a", { href: "#/scan" }, "make it from a film"),
    ".",
  );
}
