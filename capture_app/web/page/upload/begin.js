// From what was dropped to what lies in the library.
import { Upload, earlier } from "./send.js";
import { sorted } from "./gather.js";
import { uploadPanel } from "./panel.js";
/** @import {Order, Root} from "./gather.js"
 *  @import {Adopted} from "./send.js" */

/** Send what was dropped, each thing with its panel in `place`; what is unfinished on the server is
 *  continued. Returns the library items {kind, id} in order when all is there.
 *  orders: see `sorted`; of `roots` if not given.
 *  @param {Root[]} roots @param {HTMLElement} place */
export async function begin(roots, place, orders = sorted(roots)) {
  const sent = orders.map((order) => send(order, place));
  return Promise.all(sent);
}

/** @param {Order} order @param {HTMLElement} place */
async function send(order, place) {
  const known = await earlier(order).catch(() => null);
  const upload = new Upload(order, known);
  const panel = uploadPanel(upload, () => panel.remove());
  place.append(panel);
  const done = finished(upload);
  upload.start();
  return done;
}

/** @param {Upload} upload @returns {Promise<Adopted>} */
function finished(upload) {
  return new Promise((resolve) => {
    upload.addEventListener("change", () => {
      if (upload.item) resolve(upload.item);
    });
  });
}
