// The names of cameras, layers and samples, as the page and the replay say them.
/** @import {Header} from "./pack.js" */

/** @type {Record<string, string>} */
export const CAMERAS = {
  follow: "Follow the person",
  front: "From the front",
  side: "From the side",
  top: "From above",
  hands: "On the hands",
  feet: "On the feet",
  object: "On the object",
  orbit: "The whole way",
  phone: "The phone's eye",
};
/** What a camera looks at, where it needs it. @type {Record<string, string>} */
const NEEDED = {
  ...Object.fromEntries(["follow", "front", "side", "hands", "feet"].map((mode) => [mode, "root"])),
  object: "object_position",
  phone: "phone_position",
};

/** The cameras for a scene, and what they are called. @param {Header | null} header */
export function camerasOf(header) {
  const there = header?.arrays ?? {};
  return Object.entries(CAMERAS).filter(([mode]) => !NEEDED[mode] || NEEDED[mode] in there);
}
/** @type {Record<string, string>} */
export const LAYERS = {
  body: "Person",
  object: "Object",
  contacts: "Contacts",
  phone: "Phone",
  path: "Phone's path",
  trail: "Object's trail",
  grid: "Floor",
  shadow: "Shadow",
};

/** "Sample 2", numbered from 1. @param {number} index from 0 */
export function sampleWords(index) {
  return `Sample ${index + 1}`;
}

/** The same, and whether it is the best. @param {Header} header @param {number} index */
export function sampleName(header, index) {
  const best = index === header.chosen && header.samples > 1;
  return best ? `${sampleWords(index)} (best)` : sampleWords(index);
}
