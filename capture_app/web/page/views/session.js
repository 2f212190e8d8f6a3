// A recording: its report and replay, the object, the mount, and the motion to be made.
import { api, inWords } from "../core/api.js";
import { h, put } from "../core/dom.js";
import { itemHead } from "../core/library.js";
import { address, go } from "../core/router.js";
import { capital, count, span } from "../core/words.js";
import { checkList, verdict } from "../parts/checks.js";
import { numbered } from "../parts/numbered.js";
import { pickMount } from "../parts/pick_mount.js";
import { pickObject } from "../parts/pick_object.js";
import { orderForm } from "../parts/order_form.js";
import { Stage } from "../parts/stage.js";
import { trouble } from "../parts/trouble.js";

/** `#/sessions/ID?object=ID&mount=ID` */
export async function session({ params, query, signal }) {
  const item = await api(`/api/sessions/${params.id}`, { signal });
  const [objects, mounts, choices] = await Promise.all(
    ["objects", "mounts", "choices"].map((what) => api(`/api/${what}`, { signal })),
  );
  const take = new Take(item, { objects, mounts, choices, signal });
  take.update(query);
  return { title: item.name, node: take.node, update: (next) => take.update(next) };
}

class Take {
  constructor(item, { objects, mounts, choices, signal }) {
    Object.assign(this, { item, objects, mounts, signal });
    this.stage = new Stage({ label: "The recording in 3D", signal });
    this.told = h("div", { "aria-live": "polite" });
    this.checks = h("div");
    this.object = h("div");
    this.mount = h("div");
    this.order = orderForm(item, choices, () => this.look());
    this.node = h(
      "div",
      { class: "stack wide" },
      itemHead("sessions", item, count(item.files, "file")),
      this.told,
      this.stage.node,
      h("section", {}, h("h2", {}, "Checks"), this.checks),
      numbered(1, "The object", hint("The mesh of what the phone was clamped to."), this.object),
      numbered(2, "The mount", hint("Where the phone sat on the object."), this.mount),
      numbered(3, "The motion", this.order.node),
    );
  }

  update(query) {
    const before = this.chosen;
    this.chosen = { object: query.get("object"), mount: query.get("mount") };
    this.drawPicks();
    if (before && before.object === this.chosen.object && before.mount === this.chosen.mount)
      return;
    this.look();
  }

  drawPicks() {
    const focused = document.activeElement;
    const { object, mount } = this.chosen;
    const choose = (more) => go(address(`/sessions/${this.item.id}`, { ...this.chosen, ...more }));
    const here = address(`/sessions/${this.item.id}`, this.chosen);
    put(
      this.object,
      pickObject(this.objects, object, { here, chosen: (id) => choose({ object: id }) }),
    );
    put(
      this.mount,
      pickMount(this.mounts, mount, { object, here, chosen: (id) => choose({ mount: id }) }),
    );
    this.order.update(this.chosen);
    this.focusAgain(focused);
  }

  /** A radio button that was drawn anew keeps the focus. */
  focusAgain(focused) {
    if (focused?.type !== "radio" || focused.isConnected) return;
    this.node.querySelector(`input[type=radio][value="${focused.value}"]`)?.focus();
  }

  async look() {
    this.looking?.abort();
    this.looking = new AbortController();
    const signal = AbortSignal.any([this.signal, this.looking.signal]);
    put(
      this.told,
      h(
        "div",
        { class: "verdict quiet" },
        h("p", { class: "verdict-words waiting" }, "Looking at the recording…"),
      ),
    );
    this.node.setAttribute("aria-busy", "true");
    this.order.judge(null);
    const ids = Object.entries(this.chosen).filter(([, id]) => id);
    const query = new URLSearchParams([...ids, ...this.order.reading()]);
    const base = `/api/sessions/${this.item.id}`;
    // What could not be judged is left to the run, which looks for itself.
    let report = {};
    try {
      report = await api(`${base}/report?${query}`, { signal });
      this.order.judge(report);
      this.show(report, `${base}/report.html?${query}`);
      await this.stage.open(
        report.checks.length ? [{ url: `${base}/scene?${query}`, name: this.item.name }] : [],
      );
    } catch (error) {
      if (!signal.aborted) {
        put(this.told, trouble(inWords(error)));
        this.order.judge(report);
      }
    }
    if (!signal.aborted) this.node.removeAttribute("aria-busy");
  }

  show(report, page) {
    put(this.told, verdict(report), facts(report));
    put(
      this.checks,
      checkList(report.checks, (time) => this.stage.viewer?.seek(time)),
      report.floor && h("p", { class: "hint" }, capital(report.floor)),
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

function hint(text) {
  return h("p", { class: "hint" }, text);
}

function facts(report) {
  const of = report.facts ?? {};
  const told = [
    ["Recorded with", report.app],
    ["Length", of.seconds && span(of.seconds)],
    ["Poses a second", of.rate && of.rate.toFixed(0)],
    ["Usable stretches", of.stretches],
    ["Longest of them", of.longest && span(of.longest)],
  ].filter(([, value]) => value);
  return (
    told.length > 0 &&
    h(
      "dl",
      { class: "facts" },
      told.map(([key, value]) => h("div", {}, h("dt", {}, key), h("dd", {}, String(value)))),
    )
  );
}
