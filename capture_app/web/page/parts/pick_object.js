// The object of a recording: a stored mesh, or one that is dropped.
import { api } from "../core/api.js";
import { box, goTo, h, hintLine, inRow, stacked } from "../core/dom.js";
import { address } from "../core/router.js";
import { sides } from "../core/words.js";
import { bring } from "../upload/begin.js";
import { dropArea } from "../upload/drop.js";
import { pickList } from "./pick_list.js";
/** @import {Thing} from "../core/answers.js" */

/** `why`: the program has chosen it, and this is why; `other` takes what was dropped and is of another kind.
 *  @typedef {{here: string, chosen: (id: string) => void, why?: string,
 *    other?: (kind: string, id: string, words: string) => boolean}} Choosing */

export const MESHES = ".obj,.ply,.stl,.glb,.gltf,.usdz,.usda,.usdc,.mtl,.png,.jpg,.bin";

/** The choice; `chosen(id)` when there is another. `here`: where to come back to.
 *  @param {Thing[]} objects @param {string | null} current @param {Choosing} choosing */
export function pickObject(objects, current, { here, chosen, why, other }) {
  const place = box("stack");
  const items = objects.map(({ id, name, extents }) => ({ id, name, line: extents ? sides(extents) : "" }));
  return stacked(
    items.length > 0 && pickList("Object", items, current, chosen),
    why && hintLine(why),
    suspicious(objects.find(({ id }) => id === current)),
    inRow(goTo(address("/scan", { back: here }), "Make it from a film")),
    dropArea({
      title: "Drop a mesh of the object",
      text: "OBJ, PLY, STL or GLB. A scan is fine.",
      took: async (roots) => {
        const id = await bring("object", roots, place, { back: here, other });
        if (!id) return;
        objects.unshift(await api(`/api/objects/${id}`));
        if (place.isConnected) chosen(id);
      },
      folder: false,
      accept: MESHES,
      small: true,
    }),
    place,
  );
}

/** What is odd about the object's mesh. @param {Thing | undefined} object */
export function suspicious(object) {
  if (!object?.warnings?.length) return null;
  return box(
    "note",
    object.warnings.map((warning) => h("p", {}, warning)),
    h("p", {}, h("a", { href: `#/objects/${object.id}` }, "Look at it, change its unit")),
  );
}
