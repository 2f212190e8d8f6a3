// Corrections of contacts that are not solved yet: kept in the browser until they are, or thrown away.
import { store, stored } from "../core/stored.js";
/** @import {Segment} from "/static/viewer/pack.js" */

/** @param {string} result @param {number} sample */
const name = (result, sample) => `contacts of ${result}, sample ${sample}`;

/** Those of a sample of a result; null for none.
 *  @param {string} result @param {number} sample @returns {Segment[] | null} */
export function draft(result, sample) {
  const found = stored(localStorage, name(result, sample));
  return Array.isArray(found) ? found : null;
}

/** @param {string} result @param {number} sample @param {Segment[]} segments */
export function keep(result, sample, segments) {
  store(localStorage, name(result, sample), segments);
}

/** @param {string} result @param {number} sample */
export function forget(result, sample) {
  store(localStorage, name(result, sample), null);
}
