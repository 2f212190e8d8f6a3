// What is taken unless somebody says otherwise: the one object there is, the newest mount made for it.
import { api } from "./api.js";
/** @import {Mount, Thing} from "./answers.js"
 *  @import {With} from "../parts/order_form.js" */

/** Whether a thing came with the program: it is of no use with anybody's own recording. @param {string} id */
export function isExample(id) {
  return id.startsWith("e0e0e0e0e0e0e0");
}

/** The newest mount that was made for an object, and may be that of a recording; null for none. The API
 *  lists the newest first.
 *  @param {Mount[]} mounts @param {string | null} object @param {string} session */
export function usualMount(mounts, object, session) {
  const may = (/** @type {string} */ id) => !isExample(id) || isExample(session);
  return (object && mounts.find((one) => one.object === object && may(one.id))?.id) || null;
}

/** What a recording that was just brought is used with, as far as it did not bring it along; `by` is "usual"
 *  where the program chose the object.
 *  @param {string} session @param {Partial<With>} brought @returns {Promise<With & {by: string | null}>} */
export async function usual(session, { object = null, mount = null }) {
  /** @type {[Thing[], Mount[]]} */
  const [objects, mounts] = await Promise.all([api("/api/objects"), api("/api/mounts")]);
  const own = objects.filter(({ id }) => !isExample(id));
  const only = own.length === 1 ? own[0].id : null;
  const taken = object ?? only;
  const by = taken && !object ? "usual" : null;
  return { object: taken, mount: mount ?? usualMount(mounts, taken, session), by };
}
