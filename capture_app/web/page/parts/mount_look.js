// What a mount implies while it is still typed or clicked: in words, and as the phone on the object.
import { api, inWords } from "../core/api.js";
import { h, hintLine, put } from "../core/dom.js";
import { found } from "./brought.js";
/** @import {Looked} from "../core/answers.js"
 *  @import {Stage} from "./stage.js" */

const WAIT = 400; // milliseconds without a change

/** `read()`: the form as POST /api/mounts takes it; null while there is too little to say anything.
 *  @param {{stage: Stage, read: () => object | null, signal: AbortSignal}} asked */
export function mountLook({ stage, read, signal }) {
  const node = h("div", { class: "stack tight", role: "status" });
  let timer = 0;
  let newest = 0;
  const look = async () => {
    const mine = ++newest;
    const said = read();
    if (!said) {
      await show(null);
      return;
    }
    try {
      /** @type {Looked & {scene: string}} */
      const told = await api("/api/mounts/look", { json: { name: "look", ...said }, signal });
      if (mine === newest) await show(told);
    } catch (error) {
      if (mine !== newest || signal.aborted) return;
      await show(null);
      put(node, hintLine(inWords(error).what));
    }
  };
  /** @param {(Looked & {scene: string}) | null} told */
  const show = async (told) => {
    put(node, told && found(told));
    await stage.over(told?.scene ? bytesOf(told.scene) : null);
  };
  const ask = () => {
    clearTimeout(timer);
    timer = window.setTimeout(look, WAIT);
  };
  return { node, ask };
}

/** @param {string} text in base64 */
function bytesOf(text) {
  return Uint8Array.from(atob(text), (one) => one.charCodeAt(0)).buffer;
}
