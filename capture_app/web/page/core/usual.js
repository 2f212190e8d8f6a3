// What is taken unless somebody says otherwise: the one object there is, the newest mount made for it.
import { api } from "./api.js";
/** @import {Mount, Thing} from "./answers.js"
 *  @import {With} from "../parts/order_form.js" */

/** The newest mount that was made for an object; null for none. The API lists the newest first.
 *  @param {Mount[]} mounts @param {string | null} object */
export function usualMount(mounts, object) {
  return (object && mounts.find((one) => one.object === object)?.id) || null;
}

/** What a recording that was just brought is used with, as far as it did not bring it along.
 *  @param {Partial<With>} brought @returns {Promise<With>} */
export async function usual({ object = null, mount = null }) {
  /** @type {[Thing[], Mount[]]} */
  const [objects, mounts] = await Promise.all([api("/api/objects"), api("/api/mounts")]);
  const only = objects.length === 1 ? objects[0].id : null;
  const taken = object ?? only;
  return { object: taken, mount: mount ?? usualMount(mounts, taken) };
}
