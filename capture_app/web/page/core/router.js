// The address says what is shown: #/results/ID?compare=... ; back and forward just work.
import { api, inWords } from "./api.js";
import { announce, h, put } from "./dom.js";
/** @import {ApiError} from "./api.js" */

/** What a view is made for: parts of the address, and when it is left.
 *  @typedef {{params: Record<string, string>, query: URLSearchParams, signal: AbortSignal}} Visit */
/** @typedef {{title: string, node: Node, update?: (query: URLSearchParams) => void,
 *    failed?: boolean}} View */
/** @typedef {(visit: Visit) => Promise<View>} ViewOf */

/** {path, query} of an address. @param {string} hash */
export function parse(hash) {
  const [path, query = ""] = hash.replace(/^#/, "").split("?");
  return { path: path || "/", query: new URLSearchParams(query) };
}

/** The address of a path and its query; empty values are left out.
 *  @param {string} path @param {Record<string, string | null | undefined>} query */
export function address(path, query = {}) {
  const kept = Object.entries(query).flatMap(([name, value]) => (value ? [[name, value]] : []));
  const text = new URLSearchParams(kept).toString();
  return `#${path}${text ? `?${text}` : ""}`;
}

/** What is said above the next view. */
let word = "";

/** Go there; `replace` leaves no step to go back to; `words` are said above what is shown there.
 *  @param {string} hash */
export function go(hash, { replace = false, words = "" } = {}) {
  word = words;
  if (replace) location.replace(hash);
  else location.hash = hash;
}

/** Order a job, and go to it. The same key orders the same job.
 *  @param {object} json @param {string} key @param {Record<string, string | null>} query of the address */
export async function toJob(json, key, query = { from: location.hash }) {
  const job = await api("/api/jobs", { json, headers: { "Idempotency-Key": key } });
  go(address(`/jobs/${job.id}`, query));
}

/** Show views by the address.
 *  routes: [[pattern, view]]; a view is `async ({params, query, signal}) -> {title, node, update?}`;
 *  `update(query)` is called in place of a new view when only the query changes.
 *  trouble: error -> node. */
export class Router {
  /** @param {HTMLElement} main @param {[RegExp, ViewOf][]} routes
   *  @param {(error: ApiError) => Node} trouble */
  constructor(main, routes, trouble) {
    this.main = main;
    this.routes = routes;
    this.trouble = trouble;
    /** @type {string | null} */
    this.path = null;
    /** @type {View | null} */
    this.view = null;
    /** @type {HTMLElement | null} */
    this.told = null;
    this.leaving = new AbortController();
    addEventListener("hashchange", () => this.show());
  }

  /** Show what the address says; `again` also when it is shown already. */
  async show({ again = false } = {}) {
    if (location.hash && !location.hash.startsWith("#/")) return;
    const { path, query } = parse(location.hash);
    if (!again && path === this.path && this.view?.update) {
      this.view.update(query);
      this.say();
      return;
    }
    const first = this.path === null;
    this.leaving.abort();
    this.leaving = new AbortController();
    this.path = path;
    this.view = null;
    await this.open(path, query, this.leaving.signal, first || again);
  }

  /** @param {string} path @param {URLSearchParams} query @param {AbortSignal} signal @param {boolean} quiet */
  async open(path, query, signal, quiet) {
    this.main.setAttribute("aria-busy", "true");
    /** @type {View} */
    let view;
    try {
      view = await this.make(path, query, signal);
    } catch (error) {
      if (signal.aborted) return;
      view = { title: "Something is missing", node: this.trouble(inWords(error)), failed: true };
    }
    if (signal.aborted) return;
    this.view = view;
    this.main.removeAttribute("aria-busy");
    put(this.main, view.node);
    this.say();
    document.title = `${view.title} · omocap`;
    if (!quiet) arrive(this.main, view.title);
    document.dispatchEvent(new CustomEvent("shown", { detail: { path } }));
  }

  /** What `go` was to say, in place of what it said before. */
  say() {
    this.told?.remove();
    this.told = word ? h("p", { class: "note wide", role: "status" }, word) : null;
    if (this.told) this.main.prepend(this.told);
    word = "";
  }

  /** @param {string} path @param {URLSearchParams} query @param {AbortSignal} signal */
  make(path, query, signal) {
    for (const [pattern, view] of this.routes) {
      const match = pattern.exec(path);
      if (match) return view({ params: match.groups ?? {}, query, signal });
    }
    throw new Error(`no view is for ${path}`);
  }
}

/** @param {HTMLElement} main @param {string} title */
function arrive(main, title) {
  const heading = main.querySelector("h1");
  scrollTo(0, 0);
  heading?.setAttribute("tabindex", "-1");
  (heading ?? main).focus({ preventScroll: true });
  announce(title);
}
