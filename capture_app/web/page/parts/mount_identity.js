// The mount of a mesh that is made in the phone's own axes.
import { h } from "../core/dom.js";
import { mountForm } from "./mount_form.js";

/** @param {{back: string | null}} context */
export function identityForm({ back }) {
  const content = h(
    "p",
    {},
    "The origin of the mesh is the phone's camera: x to the right and y up in " +
      "the picture, z out of the screen towards you. Nothing is to be measured.",
  );
  return h(
    "section",
    { class: "card" },
    mountForm({ back, name: "Mesh around the phone", content, read: () => ({ method: "identity" }) }),
  );
}
