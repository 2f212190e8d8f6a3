// The server's JSON: every failure is an ApiError that says what, where and how to fix it.

/** Tells "lost" when the server stops answering, "back" when it answers again. */
export const connection = new EventTarget();
let lost = false;

/** What is told besides belongs to the one kind of error.
 *  @typedef {{code: string, what: string, where?: string, fix?: string, [more: string]: unknown}} Told */
/** @typedef {{method?: string, json?: unknown, body?: BodyInit, headers?: Record<string, string>,
 *    signal?: AbortSignal}} Asked */

export class ApiError extends Error {
  /** @param {number} status @param {Told} told */
  constructor(status, { code, what, where = "", fix = "", ...rest }) {
    super(what);
    this.status = status;
    this.code = code;
    this.what = what;
    this.where = where;
    this.fix = fix;
    this.rest = rest;
  }

  get offline() {
    return this.code === "offline";
  }
}

/** What was not brought yet. @param {string} what in a sentence */
export const missing = (what) => new ApiError(0, { code: "missing", what, fix: "Choose or bring it above." });

/** Ask the server. `json` is sent as a body and the answer's JSON returned (null for none).
 *  Throws ApiError, or AbortError when `signal` was raised.
 *  @param {string} path @param {Asked} asking */
export async function api(path, asking = {}) {
  const answer = await asked(path, asking);
  return answer.status === 204 ? null : answer.json();
}

/** @param {string} path @param {Asked} asking */
async function asked(path, { method, json, body, headers = {}, signal }) {
  const answer = await reach(path, {
    method: method ?? (json === undefined ? "GET" : "POST"),
    body: json === undefined ? body : JSON.stringify(json),
    headers: json === undefined ? headers : { "Content-Type": "application/json", ...headers },
    signal,
  });
  if (answer.ok) return answer;
  throw await refused(answer);
}

/** A job's id, chosen here: sent twice it is still one job. */
export function freshKey() {
  return [...crypto.getRandomValues(new Uint8Array(8))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** The bytes of a scene pack. @param {string} path @param {AbortSignal} signal @param {unknown} [json] */
export async function bytes(path, signal, json) {
  return (await asked(path, { signal, json })).arrayBuffer();
}

/** An error of any origin, as words for a person. @param {unknown} error */
export function inWords(error) {
  if (error instanceof ApiError) return error;
  return new ApiError(0, {
    code: "page",
    what: "The page came upon something it did not expect.",
    where: error instanceof Error ? error.message : String(error),
    fix: "Load the page again. Nothing on the server is lost.",
  });
}

/** @param {string} path @param {RequestInit} options */
async function reach(path, options) {
  try {
    const answer = await fetch(path, { ...options, credentials: "same-origin" });
    answered();
    return answer;
  } catch (error) {
    if (options.signal?.aborted) throw error;
    missed();
    throw new ApiError(0, {
      code: "offline",
      what: "omocap does not answer.",
      fix: "If you stopped it, start it again with: omocap serve. This page goes on by itself.",
    });
  }
}

/** @param {Response} answer */
async function refused(answer) {
  const fallback = {
    code: `http-${answer.status}`,
    what: `The server answered ${answer.status} ${answer.statusText}.`.trim(),
    fix: "Try again; if it stays so, look at what omocap serve printed.",
  };
  try {
    const told = await answer.json();
    return new ApiError(answer.status, { ...fallback, ...told, ...(told.error ?? {}) });
  } catch {
    return new ApiError(answer.status, fallback);
  }
}

function missed() {
  if (lost) return;
  lost = true;
  connection.dispatchEvent(new Event("lost"));
  knock(1000);
}

function answered() {
  if (!lost) return;
  lost = false;
  connection.dispatchEvent(new Event("back"));
}

/** @param {number} wait */
function knock(wait) {
  setTimeout(async () => {
    if (!lost) return;
    await reach("/api/health", {}).catch(() => {});
    if (lost) knock(Math.min(wait * 1.5, 5000));
  }, wait);
}
