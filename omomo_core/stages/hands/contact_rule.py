"""The paper's contact constraint (OMOMO section 3.3, figure 4): a hand that touches stays."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from omomo_core.geometry.transforms import apply, inverse
from omomo_core.motion import HandMotion
from omomo_core.stages.config import CONTACT_RULE


def constrain(
    palms: Float[np.ndarray, "frames 2 3"],
    vertices: Float[np.ndarray, "verts 3"],
    T_world_object: Float[np.ndarray, "frames 4 4"],
) -> HandMotion:
    """From the first frame a palm is within 3 cm of a vertex, it moves rigidly with the object.

    Args:
        palms: predicted left and right palm, world, metres.
        vertices: the object's vertices in its own frame (vertices, not surface, as published).
        T_world_object: the object's pose per frame.

    Returns:
        The constrained palms, and contact 1 from that frame to the end: the rule never lets go.
    """
    T_object_world = inverse(T_world_object)
    local = np.einsum("fij,fhj->fhi", T_object_world[:, :3, :3], palms)
    local += T_object_world[:, None, :3, 3]
    distance, _ = KDTree(vertices).query(local)
    held, contact = palms.copy(), np.zeros(palms.shape[:2])
    for hand in range(2):
        touching = np.flatnonzero(distance[:, hand] < CONTACT_RULE.touch)
        if len(touching):
            first = int(touching[0])
            held[first:, hand] = apply(T_world_object[first:], local[first, hand][None])[:, 0]
            contact[first:, hand] = 1.0
    return HandMotion(palms=held, contact=contact)
