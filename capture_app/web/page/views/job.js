// A job: what it is doing, how long still, cancel; it may be left and come back to.
import { api, inWords } from "../core/api.js";
import { announce, box, folded, goTo, h, hintLine, inRow, put, say } from "../core/dom.js";
import { poll } from "../core/poll.js";
import { address, go } from "../core/router.js";
import { KINDS, STATES, ended, span } from "../core/words.js";
import { doing } from "../parts/fields.js";
import { fileList } from "../parts/files.js";
import { stageList, stageWords } from "../parts/stages.js";
import { trouble, troublePage } from "../parts/trouble.js";
/** @import {Job, Made} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js" */

const EVERY = 200; // milliseconds

/** `#/jobs/ID?from=...&back=...` @param {Visit} visit */
export async function job({ params, query, signal }) {
  /** @type {Job} */
  const first = await api(`/api/jobs/${params.id}`, { signal });
  const page = new JobPage(first, { from: query.get("from"), back: query.get("back") }, signal);
  page.watch();
  return { title: first.name || KINDS[first.kind], node: page.node };
}

/** @type {Record<string, string>} */
const MADE = { results: "See the motion", mounts: "See the mount", objects: "See the object" };

class JobPage {
  /** from: address that it was ordered at; back: where its maker was before that.
   *  @param {Job} record @param {{from: string | null, back: string | null}} origin
   *  @param {AbortSignal} signal */
  constructor(record, { from, back }, signal) {
    this.record = record;
    this.from = from;
    this.back = back;
    this.signal = signal;
    this.path = `/api/jobs/${record.id}`;
    this.state = h("p", { class: "verdict-words" });
    this.bar = h("progress", { max: 1, value: 0, "aria-label": "Progress of the whole job" });
    this.line = h("p", { class: "hint figures" });
    this.stages = h("div");
    this.outcome = box("stack");
    this.log = h("ul", { class: "log" });
    this.problem = h("div");
    this.cancel = doing("Cancel", () => api(`${this.path}/cancel`, { method: "POST" }), {
      place: this.problem,
    });
    this.node = h(
      "section",
      { class: "narrow stack" },
      h(
        "header",
        { class: "head" },
        h("div", {}, h("h1", {}, record.name || KINDS[record.kind]), hintLine(KINDS[record.kind])),
      ),
      box("card stack", this.state, this.bar, this.line, this.stages, inRow(this.cancel), this.problem),
      this.outcome,
      folded("What it says", this.log),
      hintLine("You can leave this page, or close it: the work goes on, and the address brings you back."),
    );
  }

  /** Follow the job to its end. Who watched a motion being made is shown it then. */
  watch() {
    this.show(this.record);
    if (ended(this.record)) return;
    poll(
      async () => {
        this.record = await api(this.path, { signal: this.signal });
        this.show(this.record);
        const { made } = this.record;
        if (made && this.record.state === "done") go(this.made(made), { replace: true });
        return ended(this.record);
      },
      EVERY,
      this.signal,
      (error) => put(this.node, troublePage(inWords(error))),
    );
  }

  /** Address of what it made. @param {string} made */
  made(made) {
    return address(`/${made}`, { back: this.back });
  }

  /** A job that failed or was cancelled is put into the queue once more. */
  async again() {
    this.record = await api(`${this.path}/again`, { method: "POST" });
    this.watch();
  }

  /** @param {Job} record */
  show(record) {
    const words = record.state === "running" ? `${stageWords(record)}…` : STATES[record.state];
    say(this.state, words);
    announce(words);
    this.bar.value = record.state === "done" ? 1 : record.fraction;
    this.bar.hidden = ["failed", "cancelled"].includes(record.state);
    say(this.line, timeWords(record));
    put(this.stages, stageList(record));
    this.cancel.hidden = !["queued", "running"].includes(record.state);
    this.drawLog(record.log);
    this.showOutcome(record);
  }

  /** @param {Job} record */
  showOutcome(record) {
    if (this.outcome.dataset.state === record.state) return;
    this.outcome.dataset.state = record.state;
    if (!ended(record)) put(this.outcome);
    else if (record.state === "done") put(this.outcome, this.done(record));
    else put(this.outcome, record.error && trouble(record.error), this.waysOn());
  }

  waysOn() {
    const problem = h("div");
    return [
      inRow(
        doing("Begin again", () => this.again(), { place: problem }),
        this.from?.startsWith("#/") && goTo(this.from, backWords(this.from)),
      ),
      problem,
    ];
  }

  /** @param {Job} record */
  done(record) {
    if (record.made)
      return h("a", { class: "button main large", href: this.made(record.made) }, MADE[record.made.split("/")[0]]);
    const files = record.files ?? [];
    return [
      files.map(shown),
      fileList(files),
      record.result && h("a", { href: `#/results/${record.result}` }, "To the motion"),
    ];
  }

  /** @param {string[]} lines */
  drawLog(lines) {
    const there = this.log.childElementCount;
    if (lines.length < there) put(this.log);
    this.log.append(...lines.slice(this.log.childElementCount).map((line) => h("li", {}, line)));
  }
}

/** @param {Job} record */
function timeWords(record) {
  if (record.waits) return record.waits;
  if (!record.started) return "";
  const until = record.ended ? Date.parse(record.ended) : Date.now();
  const seconds = Math.max(0, (until - Date.parse(record.started)) / 1000);
  if (record.state !== "running") return span(seconds);
  const left = record.fraction > 0.1 ? (seconds * (1 - record.fraction)) / record.fraction : null;
  const percent = `${Math.round(100 * record.fraction)} %`;
  return [percent, span(seconds), left !== null && `about ${span(Math.max(1, left))} left`].filter(Boolean).join(" · ");
}

/** @param {string} from */
function backWords(from) {
  if (from.startsWith("#/sessions/")) return "Back to the recording";
  return from.startsWith("#/results/") ? "Back to the motion" : "Back, to change something";
}

/** What a browser shows by itself. @param {Made} file */
function shown(file) {
  if (file.name.endsWith(".mp4")) return h("video", { controls: true, preload: "auto", src: file.href, class: "film" });
  if (!/\.(png|webp|gif)$/.test(file.name)) return null;
  return h("img", { src: file.href, alt: "What was made", class: "film" });
}
