// A motion: to look at, to correct, to use, to share.
import { api, bytes, inWords } from "../core/api.js";
import { action, box, card, factList, folded, goTo, h, hintLine, put, say } from "../core/dom.js";
import { itemHead } from "../core/library.js";
import { address } from "../core/router.js";
import { count, size, span } from "../core/words.js";
import { contactEditor } from "../parts/contact_editor.js";
import { exportForm } from "../parts/export_form.js";
import { fileList } from "../parts/files.js";
import { resultVideo } from "../parts/result_video.js";
import { samplePicker } from "../parts/samples.js";
import { Stage } from "../parts/stage.js";
import { knownPerson } from "../parts/known_person.js";
import { sampleWords } from "/static/viewer/words.js";
/** @import {Choices, Item, Made, Motion, Result} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js"
 *  @import {Context} from "../parts/videos_form.js" */

const FPS = 30;
const FAULTLESS = "Every palm is where it should be, nothing is inside the object, and nobody is too fast.";

/** `#/results/ID` @param {Visit} visit */
export async function result({ params, signal }) {
  // What takes longest is asked for first.
  const url = `/api/results/${params.id}/scene`;
  let pack = bytes(url, signal);
  // A failure is shown by the stage that waits for it.
  pack.catch(() => {});
  /** @type {Promise<ArrayBuffer> | undefined} */
  let filmed;
  const film = () => (filmed ??= bytes(`/api/results/${params.id}/film`, signal));
  /** @type {Result} */
  const item = await api(`/api/results/${params.id}`, { signal });
  const [choices, guide, videos, sessions, materials, parent] = await Promise.all([
    ...["choices", "calibration", "videos", "sessions", "materials"].map((what) => api(`/api/${what}`, { signal })),
    item.parent ? api(`/api/results/${item.parent}`, { signal }).catch(() => null) : null,
  ]);
  const stage = new Stage({ label: `The motion ${item.name} in 3D`, signal });
  const chosen = item.chosen ?? 0;
  let shown = chosen;
  const unsolved = new Set(item.unsolved);
  /** @type {number[]} */
  let picked = [];
  const which = h("p", { class: "hint", role: "status" });
  const shared = h("a", { class: "button", download: "" }, "Download to share");
  /** What is done below is done with the sample that is shown; of several, with the last alone.
   *  A sample that is not solved is shown as it was sampled, until it is.
   *  @param {number[]} samples */
  const show = async (samples) => {
    if (samples.length === 1) [shown] = samples;
    shared.href = `/api/results/${item.id}/share.html?sample=${shown + 1}`;
    const open = () => stage.open(samples.map((sample) => ({ url, pack, film, sample, name: sampleWords(sample) })));
    const now = (picked = samples);
    const rough = samples.map((k) => k + 1).filter((number) => unsolved.has(number));
    const told = `Of ${sampleWords(shown).toLowerCase()}.`;
    if (item.samples > 1) say(which, rough.length ? `${told} Hands and feet are being finished…` : told);
    await open();
    if (!rough.length) return;
    try {
      const asked = rough.map((number) => `solved=${number}`).join("&");
      const solved = await bytes(`${url}?${asked}`, signal);
      for (const number of rough) unsolved.delete(number);
      pack = Promise.resolve(solved);
      if (picked !== now) return;
      say(which, told);
      await open();
    } catch (error) {
      if (!signal.aborted) say(which, `${told} It could not be finished: ${inWords(error).what}`);
    }
  };
  const sample = () => shown + 1;
  const node = box(
    "stack wide",
    box(
      "first",
      itemHead(
        "results",
        item,
        [line(item), origin(item, parent)],
        goTo(address("/compare", { results: item.id }), "Compare"),
      ),
      stage.node,
      contactEditor(item, stage, choices.forms.resolve),
    ),
    knownPerson(item, stage, choices.forms.run),
    box("grid", use(item, choices, materials, which, { sample, signal, stage }), share(shared), words(item, stage)),
    resultVideo(item, signal),
    moreVideos(item, { choices, guide, videos, sessions, sample, stage, signal }),
    making(item),
  );
  put(stage.side, samplePicker(item.samples, chosen, show, stage));
  show([chosen]);
  return { title: item.name, node };
}

/** @param {Result} item */
function line(item) {
  return [
    item.object_name,
    item.seconds && span(item.seconds),
    item.samples > 1 && count(item.samples, "sample", "samples"),
  ]
    .filter(Boolean)
    .join(" · ");
}

/** @param {Result} item @param {Motion | null} parent */
function origin(item, parent) {
  const both = address("/compare", { results: `${item.parent},${item.id}` });
  return [
    item.session && [
      " · ",
      h(
        "a",
        { href: address(`/sessions/${item.session}`, { object: item.object, mount: item.mount }) },
        "the recording it is made from",
      ),
    ],
    parent && [
      " · corrected from ",
      h("a", { href: `#/results/${parent.id}` }, parent.name),
      " · ",
      h("a", { href: both }, "compare the two"),
    ],
  ];
}

/** `which`: says of which sample a file is.
 *  @param {Result} item @param {Choices} choices @param {Item[]} materials @param {HTMLElement} which
 *  @param {{sample: () => number, signal: AbortSignal, stage: Stage}} shown */
function use(item, choices, materials, which, { sample, signal, stage }) {
  const files = h("div");
  /** @param {Made[]} all */
  const list = (all) => put(files, fileList(all));
  list([...item.files.filter(({ name }) => !name.endsWith(".mp4")), ...item.exports]);
  const refresh = async () => {
    /** @type {Result} */
    const now = await api(`/api/results/${item.id}`);
    list([...now.files.filter(({ name }) => !name.endsWith(".mp4")), ...now.exports]);
  };
  return card(
    "Use it",
    which,
    exportForm(item, choices, materials, { sample, signal, stage, made: refresh }),
    folded("All files", files),
  );
}

/** @param {HTMLAnchorElement} link */
function share(link) {
  return card(
    "Share it",
    hintLine("One HTML file with the motion in 3D inside. It opens in any browser, without a network."),
    link,
  );
}

/** What is known of the take, and of the sample that is shown.
 *  @param {Result} item @param {Stage} stage */
function words(item, stage) {
  const take = [...(item.findings ?? []), ...(item.notes ?? [])];
  const sample = box("stack tight");
  const tell = () => put(sample, ofShown(item, stage));
  for (const event of ["opened", "revised"]) stage.addEventListener(event, tell);
  return card(
    "Good to know",
    take.length
      ? h("ul", { class: "told" }, take.map((text) => h("li", {}, text)))
      : null,
    sample,
  );
}

/** The faults of each shown sample, and how its hands hold; a click goes to the place.
 *  @param {Result} item @param {Stage} stage */
function ofShown(item, stage) {
  return stage.scenes.map(({ sample = 0 }, slot) => {
    const header = stage.viewer?.header(slot);
    if (!header) return null;
    const rough = header.unsolved.includes(sample);
    const faults = header.faults[sample] ?? [];
    const grips = header.grips[sample] ?? [];
    return [
      item.samples > 1 ? h("h3", {}, sampleWords(sample)) : null,
      rough
        ? hintLine("How the hands and the body fit is known when it is finished.")
        : faults.length
          ? h("ul", { class: "told" }, faults.map((fault) => place(fault, stage)))
          : hintLine(FAULTLESS),
      grips.length && !rough
        ? folded("How the hands hold", h("ul", {}, grips.map((grip) => place(grip, stage))))
        : null,
    ];
  });
}

/** @param {{message: string, start: number | null}} told @param {Stage} stage */
function place({ message, start }, stage) {
  if (start === null) return h("li", {}, message);
  const go = () => {
    stage.viewer?.pause();
    stage.viewer?.seek(start / FPS);
  };
  return h("li", {}, action("link", go, message));
}

/** Forms that few people open are loaded when they are opened. @param {Result} item @param {Context} context */
function moreVideos(item, context) {
  /** @param {string} title @param {"renderForm" | "overlayForm"} form */
  const later = (title, form) => {
    const inside = h("div");
    const node = folded(title, inside);
    const load = async () => put(inside, (await import("../parts/videos_form.js"))[form](item, context));
    node.addEventListener("toggle", load, { once: true });
    return node;
  };
  return h(
    "section",
    { class: "stack" },
    h("h2", {}, "More videos"),
    later("Seen from elsewhere", "renderForm"),
    later("The person in a film of the take", "overlayForm"),
  );
}

/** @param {Result} item */
function making(item) {
  const { manifest } = item;
  const seconds = Object.values(manifest.timings).reduce((sum, time) => sum + time, 0);
  const told = [
    ["Seed", manifest.options.seed],
    ["Steps", manifest.options.steps],
    ["Person", `${manifest.body.height.toFixed(2)} m`],
    ["Mount", manifest.mount_method],
    ["Made in", span(seconds)],
    ["Size", size(item.size)],
    ["omocap", manifest.versions.omocap],
  ];
  return folded("How it was made", factList(told), hintLine(manifest.body.credit));
}
