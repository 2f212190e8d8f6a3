// The few options of a motion, and the button that makes it.
import { api } from "../core/api.js";
import { h, say } from "../core/dom.js";
import { address, go } from "../core/router.js";
import { attempt, choice, number, tick } from "./fields.js";

const FOLDED = [
  "stood",
  "steps",
  "seed",
  "contact",
  "segment",
  "floor",
  "stitch",
  "closure",
  "video",
  "force",
];

/** A form for POST /api/jobs of kind run: {node, update({object, mount})}.
 *  session: the item; defaults: of the options. */
export function orderForm(session, defaults) {
  const fields = optionFields(defaults);
  const problem = h("div");
  const lacking = h("p", { class: "note" });
  const button = h("button", { type: "submit", class: "main large" }, "Make the motion");
  const node = h(
    "form",
    { class: "stack" },
    h("div", { class: "grid" }, fields.samples.node, fields.height.node),
    h(
      "details",
      {},
      h("summary", {}, "More options"),
      h(
        "div",
        { class: "grid" },
        FOLDED.map((key) => fields[key].node),
      ),
    ),
    lacking,
    h("div", { class: "row" }, button),
    problem,
  );
  const key = freshKey();
  let chosen = { object: null, mount: null };
  node.addEventListener("submit", (event) => {
    event.preventDefault();
    attempt(button, problem, async () => {
      const options = Object.fromEntries(
        Object.entries(fields).map(([name, field]) => [name, field.read()]),
      );
      const json = { kind: "run", name: session.name, session: session.id, ...chosen, options };
      const job = await api("/api/jobs", { json, headers: { "Idempotency-Key": key } });
      go(address(`/jobs/${job.id}`, { from: location.hash }));
    });
  });
  const update = ({ object, mount }) => {
    chosen = { object, mount };
    say(lacking, missing(object, mount));
    lacking.hidden = !lacking.textContent;
    // An animation has no mount, and no phone before which anybody could stand.
    fields.stood.node.hidden = !mount;
  };
  return { node, update };
}

function missing(object, mount) {
  if (object && mount) return "";
  const what = [object ? "" : "the object", mount ? "" : "the mount"].filter(Boolean).join(" and ");
  return `Choose ${what} first. Only an animation that brings its own object needs neither.`;
}

function optionFields(defaults) {
  const stood = tick("They stood before the phone's screen when it began", {
    hint: "Who taps the phone on the object to record does.",
  });
  return {
    samples: number("Tries", {
      value: defaults.samples,
      min: 1,
      max: 64,
      step: 1,
      required: true,
      hint: "So many motions are made, and the best is shown first.",
    }),
    height: number("Height of the person", {
      unit: "m",
      min: 0.8,
      max: 2.6,

      hint: "Empty: an average adult.",
    }),
    stood: {
      ...stood,
      read: () => (stood.read() && !stood.node.hidden ? "phone" : null),
    },
    steps: number("Steps of the sampler", {
      value: defaults.steps,
      min: 1,
      max: 1000,
      step: 1,
      required: true,
      hint: "More is slower and finer.",
    }),
    seed: number("Seed", {
      value: defaults.seed,
      min: 0,
      step: 1,
      required: true,
      hint: "The same seed gives the same motion.",
    }),
    contact: choice("Hands hold the object", [
      ["segments", "while it needs them"],
      ["paper", "from first touch to the end"],
    ]),
    segment: number("Stretch to use", {
      min: 1,
      step: 1,
      hint: "Where tracking failures split the recording. Empty: the longest.",
    }),
    floor: number("Height of the floor", {
      unit: "m",
      hint: "In the phone's world. Empty: where the object rests.",
    }),
    stitch: tick("Put tracking jumps back together", {
      hint: "Instead of splitting the recording there.",
    }),
    closure: tick("The object ends on the mark where it began", {
      hint: "Takes the drift in between out.",
    }),
    video: tick("Draw a video", { checked: defaults.video ?? true }),
    force: tick("Use a recording that is not usable", {
      hint: "The motion will be wrong where the checks are red.",
    }),
  };
}

/** A job's id, chosen here: sent twice it is still one job. */
export function freshKey() {
  return [...crypto.getRandomValues(new Uint8Array(8))]
    .map((byte) => byte.toString(16).padStart(2, "0"))
    .join("");
}
