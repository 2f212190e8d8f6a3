// A recording: its report and replay, the object, the mount, and the motion to be made.
import { api, inWords } from "../core/api.js";
import { box, factList, h, hintLine, numbered, part, put } from "../core/dom.js";
import { itemHead } from "../core/library.js";
import { address, go } from "../core/router.js";
import { usualMount } from "../core/usual.js";
import { capital, count, span } from "../core/words.js";
import { drawnLater } from "../parts/cards.js";
import { checkList, verdict } from "../parts/checks.js";
import { pickMount } from "../parts/pick_mount.js";
import { pickObject } from "../parts/pick_object.js";
import { orderForm } from "../parts/order_form.js";
import { Stage } from "../parts/stage.js";
import { trouble } from "../parts/trouble.js";
/** @import {Choices, Mount, Report, Session, Thing} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js"
 *  @import {With} from "../parts/order_form.js" */

const ONLY = "It was chosen because it is the only object of your own. Is it the one that was moved?";
const NEWEST = "It was chosen because it is the newest mount of this object.";

/** Ids in the address. @typedef {With} Chosen */
/** @typedef {{objects: Thing[], mounts: Mount[], choices: Choices, signal: AbortSignal}} Context */

/** `#/sessions/ID?object=ID&mount=ID` @param {Visit} visit */
export async function session({ params, query, signal }) {
  /** @type {Session} */
  const item = await api(`/api/sessions/${params.id}`, { signal });
  const [objects, mounts, choices] = await Promise.all(
    ["objects", "mounts", "choices"].map((what) => api(`/api/${what}`, { signal })),
  );
  const take = new Take(item, { objects, mounts, choices, signal });
  take.update(query);
  const update = (/** @type {URLSearchParams} */ next) => take.update(next);
  return { title: item.name, node: take.node, update };
}

class Take {
  /** @type {Chosen | null} */
  chosen = null;
  /** @type {AbortController | null} */
  looking = null;
  /** By whom it was chosen: "usual" for the program. @type {string | null} */
  by = null;

  /** @param {Session} item @param {Context} context */
  constructor(item, { objects, mounts, choices, signal }) {
    this.item = item;
    this.objects = objects;
    this.mounts = mounts;
    this.signal = signal;
    this.stage = new Stage({ label: "The recording in 3D", signal });
    this.told = h("div", { "aria-live": "polite" });
    this.drawn = h("div");
    this.checks = h("div");
    this.object = h("div");
    this.mount = h("div");
    this.order = orderForm(item, choices, () => this.chosen && this.look(this.chosen));
    this.node = box(
      "stack wide",
      itemHead("sessions", item, count(item.files, "file")),
      this.told,
      this.drawn,
      this.stage.node,
      part("Checks", this.checks),
      numbered(1, "The object", hint("The mesh of what the phone was clamped to."), this.object),
      numbered(2, "The mount", hint("Where the phone sat on the object."), this.mount),
      numbered(3, "The motion", this.order.node),
    );
  }

  /** @param {URLSearchParams} query */
  update(query) {
    const before = this.chosen;
    const chosen = { object: query.get("object"), mount: query.get("mount") };
    this.chosen = chosen;
    this.by = query.get("by");
    this.drawPicks(chosen);
    if (before && before.object === chosen.object && before.mount === chosen.mount) return;
    this.look(chosen);
  }

  /** @param {Chosen} chosen */
  drawPicks(chosen) {
    const focused = document.activeElement;
    const { object, mount } = chosen;
    /** @param {Partial<Chosen>} more */
    const choose = (more) => go(address(`/sessions/${this.item.id}`, { ...chosen, ...more }));
    const here = address(`/sessions/${this.item.id}`, chosen);
    /** A mount dropped as an object, or the other way round, is taken as what it is.
     *  @param {string} kind @param {string} id @param {string} words */
    const other = (kind, id, words) => {
      if (kind !== "object" && kind !== "mount") return false;
      this.learn(kind, id).then(() => go(address(`/sessions/${this.item.id}`, { ...chosen, [kind]: id }), { words }));
      return true;
    };
    const usual = this.by === "usual";
    put(
      this.object,
      pickObject(this.objects, object, {
        here,
        other,
        why: usual ? ONLY : "",
        chosen: (id) => choose({ object: id, mount: usualMount(this.mounts, id, this.item.id) ?? mount }),
      }),
    );
    put(
      this.mount,
      pickMount(this.mounts, mount, {
        object,
        here,
        other,
        why: usual ? NEWEST : "",
        chosen: (id) => choose({ mount: id }),
      }),
    );
    this.order.update(chosen);
    this.focusAgain(focused);
  }

  /** A thing that has just come. @param {"object" | "mount"} kind @param {string} id */
  async learn(kind, id) {
    if (kind === "object") this.objects.unshift(await api(`/api/objects/${id}`));
    else this.mounts.unshift(await api(`/api/mounts/${id}`));
  }

  /** A radio button that was drawn anew keeps the focus. @param {Element | null} focused */
  focusAgain(focused) {
    if (!(focused instanceof HTMLInputElement) || focused.isConnected) return;
    if (focused.type !== "radio") return;
    /** @type {HTMLInputElement | null} */
    const again = this.node.querySelector(`input[type=radio][value="${focused.value}"]`);
    again?.focus();
  }

  /** @param {Chosen} chosen */
  async look(chosen) {
    this.looking?.abort();
    this.looking = new AbortController();
    const signal = AbortSignal.any([this.signal, this.looking.signal]);
    // As high as the verdict before it: what is below stays where it is.
    this.told.style.minHeight = `${this.told.offsetHeight}px`;
    put(this.told, box("verdict quiet", h("p", { class: "verdict-words waiting" }, "Looking at the recording…")));
    this.node.setAttribute("aria-busy", "true");
    this.order.judge(null);
    const ids = Object.entries(chosen).flatMap(([name, id]) => (id ? [[name, id]] : []));
    const query = new URLSearchParams([...ids, ...this.order.reading()]);
    const base = `/api/sessions/${this.item.id}`;
    // What could not be judged is left to the run, which looks for itself.
    let report = /** @type {Report | null} */ (null);
    try {
      /** @type {Report} */
      const found = await api(`${base}/report?${query}`, { signal });
      report = found;
      this.order.judge(found);
      this.show(found, `${base}/report.html?${query}`);
      this.draw(found, `sessions/${this.item.id}/picture?${query}`);
      await this.stage.open(found.checks.length ? [{ url: `${base}/scene?${query}`, name: this.item.name }] : []);
    } catch (error) {
      if (!signal.aborted) {
        put(this.told, trouble(inWords(error)));
        this.order.judge(report ?? {});
      }
    }
    if (signal.aborted) return;
    this.told.style.minHeight = "";
    this.node.removeAttribute("aria-busy");
  }

  /** The object with the phone on it, where both are chosen. @param {Report} report @param {string} src */
  draw(report, src) {
    const { object, mount } = this.chosen ?? {};
    const known = object && mount && (report.segments?.length ?? 0) > 0;
    const words = "The phone on the object: first, in mid-motion, last. A wrong mesh or mount shows here.";
    const picture = known && drawnLater(src, 1268, 420);
    if (picture) picture.alt = words;
    put(this.drawn, picture && h("figure", { class: "take" }, picture, h("figcaption", { class: "hint" }, words)));
  }

  /** @param {Report} report @param {string} page address of the one to print */
  show(report, page) {
    put(this.told, verdict(report), facts(report));
    put(
      this.checks,
      checkList(report.checks, (time) => this.stage.viewer?.seek(time)),
      report.floor && hintLine(capital(report.floor)),
      report.checks.length > 0 &&
        h(
          "p",
          {},
          h(
            "a",
            { href: page, target: "_blank", rel: "noopener" },
            "Report with all plots, to print or send (new tab)",
          ),
        ),
    );
    this.stage.node.hidden = report.checks.length === 0;
  }
}

/** @param {string} text */
function hint(text) {
  return hintLine(text);
}

/** @param {Report} report */
function facts(report) {
  const of = report.facts;
  const told = [
    ["Recorded with", report.app],
    ["Length", of.seconds && span(of.seconds)],
    ["Poses a second", of.rate && of.rate.toFixed(0)],
    ["Usable stretches", of.stretches],
    ["Longest of them", of.longest && span(of.longest)],
  ].filter(([, value]) => value);
  return told.length > 0 && factList(told);
}
