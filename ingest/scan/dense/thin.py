"""thin_parts: the bars and sheets of a solid."""

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import distance_transform_edt

BAR = 0.025
"""Metres: thinner parts have no depth that can be trusted, and silhouettes bound them."""


def thin_parts(
    inside: Bool[np.ndarray, "z y x"], voxel: float, radius: float
) -> Bool[np.ndarray, "z y x"]:
    """Places of a solid into which no ball of the radius fits that stays inside of it.

    Args:
        inside: the solid.
        voxel, radius: metres.
    """
    step = 2 if voxel < radius / 4 else 1
    coarse = np.pad(inside[::step, ::step, ::step], 1)
    # The floor below does not end a solid that stands on it.
    coarse[0] = coarse[1]
    core = np.asarray(distance_transform_edt(coarse)) * (step * voxel) >= radius
    thick = np.asarray(distance_transform_edt(~core)) * (step * voxel) <= radius
    found = coarse & ~thick
    for axis in range(3):
        found = np.repeat(found.take(range(1, found.shape[axis] - 1), axis), step, axis)
    z, y, x = inside.shape
    return found[:z, :y, :x] & inside
