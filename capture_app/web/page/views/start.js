// The first page: what this is, where to drop a recording, and everything that was done before.
import { api, inWords } from "../core/api.js";
import { box, h, hintLine, inRow, part, put } from "../core/dom.js";
import { poll } from "../core/poll.js";
import { address, go } from "../core/router.js";
import { usual } from "../core/usual.js";
import { ended, size } from "../core/words.js";
import { itemRow, jobRow, resultCard } from "../parts/cards.js";
import { doing } from "../parts/fields.js";
import { trouble } from "../parts/trouble.js";
import { begin, bring } from "../upload/begin.js";
import { dropArea } from "../upload/drop.js";
import { kindOf } from "../upload/gather.js";
import { uploadPanel } from "../upload/panel.js";
import { running } from "../upload/send.js";
/** @import {Job, Motion, Session, Unfinished} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js"
 *  @import {Root} from "../upload/gather.js" */

const SHOWN = 8;

/** `#/` @param {Visit} visit */
export async function start({ signal }) {
  const [results, sessions, jobs, uploads] = await Promise.all(
    ["results", "sessions", "jobs", "uploads"].map((what) => api(`/api/${what}`, { signal })),
  );
  const place = h("div", { class: "stack", id: "uploads" });
  const working = h("div");
  put(place, [...running.values()].map((one) => uploadPanel(one)), unfinished(uploads));
  showJobs(working, jobs);
  poll(async () => showJobs(working, await api("/api/jobs", { signal })), 2000, signal, () => {});
  const node = box(
    "stack wide",
    hero(place),
    place,
    working,
    results.length === 0 && steps(),
    resultsPart(results),
    sessionsPart(sessions),
  );
  return { title: "Start", node };
}

/** @param {HTMLElement} place */
function hero(place) {
  const problem = h("div");
  const area = dropArea({
    title: "Drop a recording here",
    text:
      "The folder your logger app wrote, a zip of it, or its files. The object's " +
      "mesh and mount.json may come along.",
    took: (roots) => take(roots, place, problem),
  });
  return h(
    "section",
    { class: "hero" },
    h("h1", {}, "Move a thing. Get your whole body’s motion."),
    h(
      "p",
      { class: "lead" },
      "Clamp an iPhone to a chair, a box or a mop, record how you move it, and " +
        "drop the recording here. You get the motion of the person who moved it, for " +
        "Blender, Unity, Unreal or your own code.",
    ),
    area,
    problem,
    box(
      "row centre",
      doing("Try the example", example, { place: problem }),
      h("span", { class: "hint" }, "Everything stays on this computer."),
    ),
  );
}

async function example() {
  const { session, object, mount } = await api("/api/example", { method: "POST" });
  go(address(`/sessions/${session}`, { object, mount }));
}

/** @param {Root[]} roots @param {HTMLElement} place @param {HTMLElement} problem */
async function take(roots, place, problem) {
  put(problem);
  try {
    const what = kindOf(roots);
    if (what === "video" || what === "material") {
      await bring("session", roots, place, { back: null });
      return;
    }
    const items = await begin(roots, place);
    const [session, object, mount] = ["session", "object", "mount"].map(
      (kind) => items.find((item) => item.kind === kind)?.id,
    );
    if (!place.isConnected) return;
    if (session) go(address(`/sessions/${session}`, { ...(await usual(session, { object, mount })) }));
    else go(object ? `#/objects/${object}` : `#/mounts/${mount}`);
  } catch (error) {
    put(problem, trouble(inWords(error)));
  }
}

/** @param {Unfinished[]} uploads */
function unfinished(uploads) {
  return uploads
    .filter(({ id }) => !running.has(id))
    .map((upload) => {
      const problem = h("div");
      const card = h(
        "section",
        { class: "card upload", "aria-label": `Unfinished upload: ${upload.name}` },
        h("h2", { class: "small" }, `Unfinished: ${upload.name}`),
        h("progress", {
          max: upload.size || 1,
          value: upload.received,
          "aria-label": `Upload of ${upload.name}`,
        }),
        hintLine(
          `${size(upload.received)} of ${size(upload.size)} arrived. Drop the same ` +
            `folder or files again to go on from there.`,
        ),
        problem,
        inRow(
          doing(
            "Throw it away",
            async () => {
              await api(`/api/uploads/${upload.id}`, { method: "DELETE" });
              card.remove();
            },
            { kind: "quiet", place: problem },
          ),
        ),
      );
      card.dataset.upload = upload.id;
      return card;
    });
}

/** @param {HTMLElement} place @param {Job[]} jobs */
function showJobs(place, jobs) {
  const live = jobs.filter((job) => !ended(job));
  if (live.length === 0) return put(place) && false;
  put(place, part("Working now", h("ul", { class: "rows" }, live.map((job) => jobRow(job)))));
  return false;
}

/** @param {Motion[]} results */
function resultsPart(results) {
  if (results.length === 0) return null;
  return h(
    "section",
    {},
    box("head", h("h2", {}, "Motions"), more(results)),
    box("tiles", results.slice(0, SHOWN).map(resultCard)),
  );
}

/** @param {Session[]} sessions */
function sessionsPart(sessions) {
  if (sessions.length === 0) return null;
  return h(
    "section",
    {},
    box("head", h("h2", {}, "Recordings"), more(sessions)),
    h("ul", { class: "rows" }, sessions.slice(0, SHOWN).map((one) => itemRow("sessions", one))),
  );
}

/** @param {unknown[]} list */
function more(list) {
  return list.length > SHOWN && h("a", { href: "#/library" }, `All ${list.length}`);
}

function steps() {
  const told = [
    ["Record", "Clamp the phone, start an ARKit logger (Stray Scanner, Record3D and others), move the object."],
    ["Drop", "You are told at once whether the recording is good, and what to do better if not."],
    ["Use", "Look at the motion in 3D, correct where hands hold, download it for your program."],
  ];
  return h(
    "ol",
    { class: "steps" },
    told.map(([title, text], at) =>
      h(
        "li",
        { class: "card" },
        h("span", { class: "step-number", "aria-hidden": "true" }, String(at + 1)),
        h("h2", { class: "small" }, title),
        hintLine(text),
      ),
    ),
  );
}
