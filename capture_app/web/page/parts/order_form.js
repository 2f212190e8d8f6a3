// The few options of a motion, and the button that makes it.
import { freshKey } from "../core/api.js";
import { folded, freshId, h, inRow, say, stacked } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { attempt, choice, describedFields, field, grid, saidIn, tick } from "./fields.js";
import { remembered } from "../core/stored.js";
/** @import {Choices, Described, Report, Session} from "../core/answers.js"
 *  @import {Field} from "./fields.js" */

/** Ids of what a motion is made with. @typedef {{object: string | null, mount: string | null}} With */

const DIRECTION = "direction";
const NUMBER = String.raw`\s*[\-+]?(\d+\.?\d*|\.\d+)\s*`;
const AXES = ["x", "y", "z", "-x", "-y", "-z"];
const NOT_USABLE = "not usable";
/** @type {Record<string, string>} */
const SIDES = { front: "in front of it", back: "behind it", left: "on its left", right: "on its right" };
const SEEN_ALONG = "Where the person is while they hold it, seen in the direction in which it goes.";

/** A form for POST /api/jobs of kind run: {node, update({object, mount}), judge(report), reading()}.
 *  session: the item; choices: of the server; changed(): what is said of the recording is another.
 *  @param {Session} session @param {Choices} choices @param {() => void} changed */
export function orderForm(session, choices, changed) {
  const form = choices.forms.run;
  const fields = describedFields(form, { up: upField(), stood: stoodField(), side: sideField(form) });
  /** @param {Described["group"]} wanted */
  const group = (wanted) =>
    Object.fromEntries(
      form.flatMap(({ name, group: own }) => (own === wanted && fields[name] ? [[name, fields[name]]] : [])),
    );
  const reading = group("reading");
  const problem = h("div");
  const why = h("p", { class: "note", id: freshId("why"), role: "status" });
  const button = h("button", { type: "submit", class: "main large" }, "Make the motion");
  button.setAttribute("aria-describedby", why.id);
  const known = grid(reading);
  const more = folded("More options", grid(group("more")), h("h3", {}, "What the recording does not say"), known);
  const node = h("form", { class: "stack" }, grid(group("main")), more, why, inRow(button), problem);
  const key = freshKey();
  /** @type {With} */
  let chosen = { object: null, mount: null };
  /** @type {Partial<Report> | null} */
  let report = null;
  /** Who has pressed the button while the recording is looked at. @type {(() => void)[]} */
  const waiting = [];
  const looked = () =>
    report ? undefined : new Promise((/** @type {(_: void) => void} */ told) => waiting.push(told));
  // While it is looked at nothing changes here: the button stays under the pointer that presses it.
  const weigh = () => {
    if (!report) return;
    const forced = fields.force.read() || (form.find(({ name }) => name === "force")?.title ?? "");
    say(why, obstacle(chosen, report, forced));
    why.hidden = !why.textContent;
    button.disabled = !why.hidden;
  };
  node.addEventListener("submit", (event) => {
    event.preventDefault();
    attempt(button, problem, async () => {
      await looked();
      if (button.disabled) return;
      const options = saidIn(fields);
      const json = { kind: "run", name: session.name, session: session.id, ...chosen, options };
      await toJob(json, key);
    });
  });
  // Taken up before anything listens: the view looks at the recording by itself.
  const left = remembered(node, `options of ${session.id}`);
  more.open = left.some((one) => more.contains(one));
  known.addEventListener("change", changed);
  fields.force.input.addEventListener("change", weigh);
  /** @param {With} now */
  const update = ({ object, mount }) => {
    chosen = { object, mount };
    // An animation has no mount, and no phone before which anybody could stand.
    fields.stood.node.hidden = !mount;
    weigh();
  };
  /** @param {Partial<Report> | null} found */
  const judge = (found) => {
    report = found;
    if (found?.verdict === NOT_USABLE) more.open = true;
    weigh();
    if (found) for (const told of waiting.splice(0)) told();
  };
  return { node, update, judge, reading: () => readingQuery(reading) };
}

/** Why no motion can be made as it is, in a sentence; "" when it can.
 *  @param {With} chosen @param {Partial<Report>} report
 *  @param {true | string} forced true, or the label of what forces it */
function obstacle({ object, mount }, report, forced) {
  if (report.animated) return "";
  if (!object || !mount) {
    const what = [object ? "" : "the object", mount ? "" : "the mount"].filter(Boolean);
    return `Choose ${what.join(" and ")} first. Only an animation that brings its own object needs neither.`;
  }
  const able = (report.segments?.length ?? 0) > 0;
  if (report.verdict !== NOT_USABLE || (able && forced === true)) return "";
  const force = able ? ` To use it all the same, tick “${forced}” above.` : "";
  return `This recording is not usable: ${report.reason}${force}`;
}

/** A side of the object by its word; a place is clicked on in the result. @param {Described[]} form */
function sideField(form) {
  const title = form.find(({ name }) => name === "side")?.title ?? "";
  const sides = ["front", "back", "left", "right"].map((side) => [side, SIDES[side] ?? side]);
  const made = choice(title, [["", "as usual"], ...sides], { hint: SEEN_ALONG });
  return { ...made, read: () => made.read() || null };
}

/** Where they stood is known where the phone saw them; elsewhere it is clicked on in the result. */
function stoodField() {
  const asked = tick("They stood before the phone's screen when it began", {
    hint: "Who taps the phone on the object to record does.",
  });
  return { ...asked, read: () => (asked.read() && !asked.node.hidden ? "phone" : null) };
}

/** What is said in them, as the query of a report has it. @param {Record<string, Field<any>>} fields */
function readingQuery(fields) {
  return Object.entries(fields).flatMap(([name, one]) => {
    const value = one.read();
    return value === null || value === false ? [] : [[name, String(value)]];
  });
}

/** The way up: an axis of the mesh, or a direction. @returns {Field<any>} */
function upField() {
  const which = choice(
    "Which way is up",
    [
      ["", "as the log says, or found"],
      ...AXES.map((axis) => [`object:${axis}`, `along ${axis} of the mesh where the object rests`]),
      [DIRECTION, "a direction in the phone's world"],
    ],
    { hint: "Where the log does not say it." },
  );
  const input = h("input", { type: "text", placeholder: "0,1,0", pattern: `${NUMBER},${NUMBER},${NUMBER}` });
  const typed = field("Direction of up", input, "Three numbers in the phone's world, e.g. 0,1,0.");
  const show = () => {
    typed.hidden = which.read() !== DIRECTION;
    input.disabled = typed.hidden;
    input.required = !typed.hidden;
  };
  which.input.addEventListener("change", show);
  show();
  const direction = () => (input.value && input.checkValidity() ? input.value.split(",").map(Number) : null);
  const read = () => (which.read() === DIRECTION ? direction() : which.read() || null);
  return { node: stacked(which.node, typed), input: which.input, read };
}
