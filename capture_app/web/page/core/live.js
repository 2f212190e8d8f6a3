// What a screen reader is told when something changes that the eye sees by itself.

let last = "";

/** Say a sentence once, politely. */
export function announce(sentence) {
  if (sentence === last) return;
  last = sentence;
  document.getElementById("live").textContent = sentence;
}
