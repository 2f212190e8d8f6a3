// From what was dropped to what lies in the library.
import { address, go } from "../core/router.js";
import { kindOf, order, sorted } from "./gather.js";
import { Upload, earlier } from "./send.js";
import { uploadPanel } from "./panel.js";
/** @import {Order, Root} from "./gather.js"
 *  @import {Adopted} from "./send.js" */

/** Send what was dropped, each thing with its panel in `place`; what is unfinished on the server is
 *  continued. Returns the library items {kind, id} in order when all is there.
 *  orders: see `sorted`; of `roots` if not given.
 *  @param {Root[]} roots @param {HTMLElement} place */
export async function begin(roots, place, orders = sorted(roots)) {
  const sent = orders.map((one) => send(one, place));
  return Promise.all(sent);
}

/** @param {Order} what @param {HTMLElement} place */
async function send(what, place) {
  const known = await earlier(what).catch(() => null);
  const upload = new Upload(what, known);
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

/** Where a thing of each kind is shown, and why it is taken there. */
/** @type {Record<string, {at: (id: string, back: string | null) => string, words: string}>} */
const PLACES = {
  session: {
    at: (id) => `#/sessions/${id}`,
    words: "This is a recording, so it was taken as one. Its object and mount are chosen here.",
  },
  object: { at: (id) => `#/objects/${id}`, words: "This is a mesh, so it was taken as an object." },
  mount: { at: (id) => `#/mounts/${id}`, words: "This is a mount, so it was taken as one." },
  video: {
    at: (id, back) => address("/scan", { source: id, back }),
    words: "A film is no recording: it does not say where the phone was. The object can be made from it here.",
  },
  material: {
    at: (id, back) => address("/scan", { source: id, back }),
    words: "Photos are no recording: they do not say where the phone was. The object can be made from them here.",
  },
};

/** Send what was dropped where one kind was asked for. What is clearly of another kind is taken as that, and
 *  shown where it belongs, unless `other` takes it. Returns the id of what was asked for, or null.
 *  @param {string} asked @param {Root[]} roots @param {HTMLElement} place
 *  @param {{back: string | null, other?: (kind: string, id: string, words: string) => boolean}} more */
export async function bring(asked, roots, place, { back, other = () => false }) {
  const kind = kindOf(roots);
  const [item] = await begin(roots, place, [order(kind, roots)]);
  if (!place.isConnected) return null;
  if (kind === asked) return item.id;
  const { at, words } = PLACES[kind];
  if (!other(kind, item.id, words)) go(at(item.id, back), { words });
  return null;
}
