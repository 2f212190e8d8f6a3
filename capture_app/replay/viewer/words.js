// The names of cameras, layers and samples, as the page and the replay say them.
/** @import {Header} from "./pack.js" */

/** @type {Record<string, string>} */
export const CAMERAS = {
  follow: "Follow the person",
  orbit: "The whole way",
  object: "On the object",
  phone: "The phone's eye",
  top: "From above",
};
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
