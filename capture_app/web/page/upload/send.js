// A resumable upload: chunks by offset, pause, growing waits when the line is lost.
import { api, ApiError, inWords } from "../core/api.js";
import { rest } from "../core/poll.js";
/** @import {Announced, Arrived, Unfinished} from "../core/answers.js"
 *  @import {Order} from "./gather.js" */

/** A thing of the library that an upload became. @typedef {{kind: string, id: string}} Adopted */
/** @typedef {"starting" | "sending" | "paused" | "waiting" | "finishing" | "done" | "failed"
 *    | "cancelled"} State waiting: for the line */
/** A file, and how much of it has arrived. @typedef {Arrived & {file: File}} Seat */

const SMALLEST = 256 * 1024;
const LARGEST = 16 * 1024 * 1024;
const AT_ONCE = 4;
const WINDOW = 6; // seconds over which the rate is told
const WAITS = [1, 2, 4, 8, 15, 30];

/** Uploads of this tab by id; they go on while other pages are looked at.
 *  @type {Map<string, Upload>} */
export const running = new Map();

/** Tells "change" whenever anything below is another. */
export class Upload extends EventTarget {
  /** @type {State} */
  state = "starting";
  received = 0;
  rate = 0; // bytes a second
  /** @type {ApiError | null} */
  error = null;
  /** @type {Adopted | null} */
  item = null; // when done
  /** When so many bytes had arrived. @type {[number, number][]} */
  marks = [];
  /** @type {Seat[]} */
  seats = [];
  /** @type {Promise<Announced> | null} */
  announced = null;

  /** known: the server's record of an earlier attempt.
   *  @param {Order} order @param {Announced | null} known */
  constructor(order, known = null) {
    super();
    this.order = order;
    this.files = new Map(order.files.map((one) => [one.path, one.file]));
    this.id = known?.id ?? null;
    this.size = order.files.reduce((sum, { file }) => sum + file.size, 0);
    this.chunk = 2 * 1024 * 1024;
    this.stop = new AbortController();
  }

  get secondsLeft() {
    return this.rate > 0 ? (this.size - this.received) / this.rate : null;
  }

  /** Send what is missing; resolves when it is done, paused, failed or cancelled. */
  async start() {
    const stop = new AbortController();
    this.stop = stop;
    this.marks = [];
    this.become("sending");
    try {
      const record = await this.record();
      stop.signal.throwIfAborted();
      this.seats = record.files.map((one) => ({ ...one, file: this.fileOf(one.path) }));
      this.count();
      const queue = this.seats.filter((seat) => seat.received < seat.size);
      await Promise.all(Array.from({ length: AT_ONCE }, () => this.work(queue)));
      stop.signal.throwIfAborted();
      await this.finish();
    } catch (error) {
      if (stop.signal.aborted) return;
      stop.abort();
      this.error = inWords(error);
      this.become("failed");
    }
  }

  /** Stop sending; what has arrived stays. */
  pause() {
    this.stop.abort();
    this.become("paused");
  }

  /** Stop and throw away what has arrived. */
  async cancel() {
    this.stop.abort();
    await this.announced?.catch(() => null);
    if (this.id) {
      await api(`/api/uploads/${this.id}`, { method: "DELETE" });
      running.delete(this.id);
    }
    this.become("cancelled");
  }

  /** Have the library take it; a mesh's unit may be told.
   *  @param {{scale?: number}} told */
  async finish(told = {}) {
    this.become("finishing");
    const signal = this.stop.signal;
    this.item = await api(`/api/uploads/${this.id}/finish`, { json: told, signal });
    if (this.id) running.delete(this.id);
    this.become("done");
  }

  /** What the server has of it, which is told of it first. @returns {Promise<Announced>} */
  async record() {
    if (this.id) return api(`/api/uploads/${this.id}`, { signal: this.stop.signal });
    this.announced ??= this.announce().finally(() => (this.announced = null));
    return this.announced;
  }

  async announce() {
    const { kind, name, files } = this.order;
    const listed = files.map(({ path, file }) => ({ path, size: file.size }));
    // A pause does not stop this: what the server has begun it must be told to throw away.
    /** @type {Announced} */
    const made = await this.again(() => api("/api/uploads", { json: { kind, name, files: listed } }));
    this.id = made.id;
    running.set(this.id, this);
    return made;
  }

  /** @param {string} path */
  fileOf(path) {
    const file = this.files.get(path);
    if (!file) throw new Error(`${path} is not among the files that were dropped`);
    return file;
  }

  /** @param {Seat[]} queue */
  async work(queue) {
    for (let seat = queue.shift(); seat; seat = queue.shift()) {
      while (seat.received < seat.size) await this.again(() => this.sendChunk(seat));
    }
  }

  /** @param {Seat} seat */
  async sendChunk(seat) {
    const offset = seat.received;
    const part = seat.file.slice(offset, offset + this.chunk);
    const began = performance.now();
    try {
      const { received } = await api(`/api/uploads/${this.id}/files/${seat.index}?offset=${offset}`, {
        method: "PUT",
        body: part,
        headers: { "Content-Type": "application/octet-stream" },
        signal: this.stop.signal,
      });
      seat.received = received;
      this.fit(part.size, performance.now() - began);
    } catch (error) {
      // Another tab, or an answer that was lost: go on where the server is.
      const received = error instanceof ApiError && error.status === 409 && error.rest.received;
      if (typeof received !== "number") throw error;
      seat.received = received;
    }
    this.count();
  }

  /** Try until the line is back. @template T @param {() => Promise<T>} act */
  async again(act) {
    for (let attempt = 0; ; attempt += 1) {
      try {
        const value = await act();
        if (this.state === "waiting") this.become("sending");
        return value;
      } catch (error) {
        if (this.stop.signal.aborted || !passing(error)) throw error;
        this.become("waiting");
        await rest(1000 * WAITS[Math.min(attempt, WAITS.length - 1)], this.stop.signal);
      }
    }
  }

  /** Chunks of about a second, so that progress is seen and little is lost with the line.
   *  @param {number} size @param {number} milliseconds */
  fit(size, milliseconds) {
    const second = (size * 1000) / Math.max(milliseconds, 1);
    this.chunk = Math.min(Math.max(second, SMALLEST), LARGEST) | 0;
  }

  count() {
    this.received = this.seats.reduce((sum, seat) => sum + seat.received, 0);
    const now = performance.now() / 1000;
    this.marks = [...this.marks.filter(([time]) => now - time < WINDOW), [now, this.received]];
    const [time, received] = this.marks[0];
    if (now - time > 0.5) this.rate = (this.received - received) / (now - time);
    this.dispatchEvent(new Event("change"));
  }

  /** @param {State} state */
  become(state) {
    this.state = state;
    this.dispatchEvent(new Event("change"));
  }
}

/** The unfinished upload on the server that these files continue, or null.
 *  @param {Order} order @returns {Promise<Announced | null>} */
export async function earlier(order) {
  /** @type {Unfinished[]} */
  const all = await api("/api/uploads");
  const same = all.filter((one) => one.kind === order.kind && one.name === order.name);
  for (const { id } of same) {
    /** @type {Announced} */
    const record = await api(`/api/uploads/${id}`);
    if (sameFiles(record.files, order.files)) return record;
  }
  return null;
}

/** @param {Announced["files"]} ours @param {Order["files"]} theirs */
function sameFiles(ours, theirs) {
  const sizes = new Map(theirs.map(({ path, file }) => [path, file.size]));
  return ours.length === theirs.length && ours.every(({ path, size }) => sizes.get(path) === size);
}

/** @param {unknown} error */
function passing(error) {
  if (!(error instanceof ApiError)) return false;
  return error.offline || [408, 429, 500, 502, 503, 504].includes(error.status);
}
