// What a screen reader is told when something changes that the eye sees by itself.

import { here } from "./dom.js";

let last = "";

/** Say a sentence once, politely. @param {string} sentence */
export function announce(sentence) {
  if (sentence === last) return;
  last = sentence;
  here("live").textContent = sentence;
}
