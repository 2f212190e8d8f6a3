"""Stage 1 as published: palms from the object's motion, and the published contact rule."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree
from torch import Tensor

from omomo_core.geometry.object_features import PAPER_POINTS
from omomo_core.geometry.rotations import into_frame, out_of_frame, yaw_matrix
from omomo_core.geometry.transforms import apply, inverse
from omomo_core.motion import HandMotion
from omomo_core.stages.stage import ObjectWindows, StageConfig
from omomo_core.stages.stage_config import CONTACT_RULE, Size, paper_stage_config


def config(size: Size) -> StageConfig:
    """Object centre and BPS in, palms out."""
    return paper_stage_config("hands", size, channels=6, condition=3, shape=3 * PAPER_POINTS)


CONFIG = config("published")


def condition(
    windows: ObjectWindows, origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames 3"]:
    """The object's centre in the frame, metres."""
    return into_frame(windows.centre, origin, yaw)


def shape_code(
    windows: ObjectWindows, yaw: Float[Tensor, " b"], patch: int
) -> Float[Tensor, "b tokens shape"]:
    """BPS in the frame's axes, in the middle of each patch of so many frames."""
    R_world_object = windows.R_world_object[:, patch // 2 :: patch]
    R_frame_world = yaw_matrix(-yaw)[:, None].to(R_world_object.dtype)
    return windows.shape(R_frame_world @ R_world_object).flatten(-2)


def pack(
    palms: Float[Tensor, "b frames 2 3"], origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames 6"]:
    """Palm positions in the frame."""
    return into_frame(palms, origin, yaw).flatten(-2)


def unpack(
    x: Float[Tensor, "b frames 6"], origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames 2 3"]:
    """Palms in the world."""
    return out_of_frame(x.unflatten(-1, (2, 3)), origin, yaw)


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
