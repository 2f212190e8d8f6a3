// The mount of a recording: a stored one, a dropped mount.json, or one found in the page.
import { api } from "../core/api.js";
import { box, goTo, h, hintLine, inRow, stacked } from "../core/dom.js";
import { address } from "../core/router.js";
import { bring } from "../upload/begin.js";
import { dropArea } from "../upload/drop.js";
import { pickList } from "./pick_list.js";
/** @import {Mount} from "../core/answers.js"
 *  @import {Choosing} from "./pick_object.js" */

// In place of a mount's id, as the API has it.
const OWN_FRAME = {
  id: "identity",
  name: "The mesh is in the phone's own frame",
  line: "No mount: the origin of the mesh is the phone's camera, x to the right, y up, z towards you",
};
const CLAMPED = "It was made for this object. If you clamped the phone anew since then, find the mount again.";

/** The choice; those made for the object come first. `here`: where to come back to.
 *  @param {Mount[]} mounts @param {string | null} current
 *  @param {Choosing & {object: string | null}} choosing */
export function pickMount(mounts, current, { object, here, chosen, why, other }) {
  const place = box("stack");
  const taken = mounts.find(({ id }) => id === current);
  /** @param {Mount} mount */
  const fit = (mount) => Number(mount.object === object && object !== null);
  const items = [...mounts]
    .sort((a, b) => fit(b) - fit(a))
    .map((mount) => ({
      id: mount.id,
      name: mount.name,
      line: [mount.found, fit(mount) ? "made for this object" : ""].filter(Boolean).join(" · "),
    }));
  return stacked(
    pickList("Mount", [...items, OWN_FRAME], current, chosen),
    taken && fit(taken) > 0 && hintLine([why, CLAMPED].filter(Boolean).join(" ")),
    mountWarning(taken),
    inRow(goTo(address("/calibrate", { object, back: here }), "Find it now, step by step")),
    dropArea({
      title: "Drop a mount.json",
      text: "What omocap calibrate wrote.",
      took: async (roots) => {
        const id = await bring("mount", roots, place, { back: here, other });
        if (!id) return;
        mounts.unshift(await api(`/api/mounts/${id}`));
        if (place.isConnected) chosen(id);
      },
      folder: false,
      accept: ".json",
      small: true,
    }),
    place,
  );
}

/** A word of warning where the mount may be far off. @param {Mount | undefined} mount */
export function mountWarning(mount) {
  if (!mount?.warnings.length) return null;
  return box("note", mount.warnings.map((text) => h("p", {}, text)));
}
