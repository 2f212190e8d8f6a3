// Corrected contacts are solved by themselves a moment after the last correction, in the picture alone.
import { bytes, inWords } from "../core/api.js";
import { withPeople } from "/static/viewer/pack.js";
/** @import {Pack} from "/static/viewer/pack.js"
 *  @import {Stage} from "./stage.js" */

const WAIT = 150; // milliseconds without another correction

export class Trial {
  timer = 0;
  coming = new AbortController();
  /** The motion as it was. @type {Pack | null} */
  own = null;

  /** @param {string} result its id @param {Stage} stage @param {(words: string) => void} tell */
  constructor(result, stage, tell) {
    this.url = `/api/results/${result}/scene`;
    this.stage = stage;
    this.tell = tell;
    stage.signal.addEventListener("abort", () => this.stop());
  }

  /** Another scene was opened. */
  attach() {
    this.stop();
    this.own = this.stage.viewer?.pack(0) ?? null;
  }

  /** What waits is not solved, and what is being solved is not shown. */
  stop() {
    clearTimeout(this.timer);
    this.coming.abort();
  }

  /** Solve this soon, in place of what waits. @param {() => object} order */
  soon(order) {
    this.stop();
    this.timer = window.setTimeout(() => this.solve(order()), WAIT);
  }

  /** Show the motion as it was. */
  revert() {
    this.stop();
    if (this.own && this.stage.viewer?.pack(0) !== this.own) this.stage.revise(this.own);
  }

  /** @param {object} json */
  async solve(json) {
    const { signal } = (this.coming = new AbortController());
    this.tell("The motion is being solved again…");
    try {
      const people = await bytes(this.url, signal, json);
      if (signal.aborted || !this.own) return;
      this.stage.revise(withPeople(this.own, people));
      this.tell("This is how they move with these contacts. Keep it, or correct on.");
    } catch (error) {
      if (!signal.aborted) this.tell(inWords(error).what);
    }
  }
}
