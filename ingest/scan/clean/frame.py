"""object_frame: where an object's own frame is: z up, base at 0, in the middle of its footprint."""

import cv2
import numpy as np
from jaxtyping import Float64

_FOOT = 0.05
"""Part of the height, at least so many metres as follow, that is the foot of an object."""
_LEAST_FOOT = 0.02


def object_frame(
    vertices: Float64[np.ndarray, "verts 3"], T_world_floor: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "4 4"]:
    """T_world_object of an object that stands on a floor.

    x runs along the side of the smallest rectangle around the footprint that is nearest to the
    floor's x axis; that rectangle's middle is the origin, the object's lowest vertex at z = 0.

    Args:
        vertices: world, metres.
        T_world_floor: z is the floor's normal.
    """
    standing = (vertices - T_world_floor[:3, 3]) @ T_world_floor[:3, :3]
    base = float(standing[:, 2].min())
    height = float(np.ptp(standing[:, 2]))
    foot = standing[standing[:, 2] < base + max(_FOOT * height, _LEAST_FOOT), :2]
    middle, _, turn = cv2.minAreaRect(foot.astype(np.float32))
    angle = np.radians((turn + 45) % 90 - 45)
    T_floor_object = np.eye(4)
    T_floor_object[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T_floor_object[:3, 3] = [*middle, base]
    return T_world_floor @ T_floor_object
