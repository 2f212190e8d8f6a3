"""Limit on the angular speed of arms, applied before the trajectory is optimised."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from omomo_core.body.trajectory_optimization.config import ARM_SPEED
from omomo_core.geometry.procrustes import nearest_rotation
from omomo_core.geometry.transforms import turning_speed
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_CHEST = joint("spine3")
_ARMS = tuple(joint(f"{side}_{name}") for name in ("shoulder", "elbow") for side in
              ("left", "right"))  # fmt: skip


def limit_arm_speed(
    rotations: Float[np.ndarray, "frames 22 3 3"],
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Return rotations in which the quickest turns of shoulders and elbows are spread over time.

    Blending a recorded arm into one that holds can turn the upper arm about itself in an instant.
    Palms move a little, and have to be solved again.
    """
    out = rotations.copy()
    chest = rotations[:, _CHEST]
    for j in _ARMS:
        local = np.swapaxes(chest, -1, -2) @ rotations[:, j]
        for _ in range(ARM_SPEED.rounds):
            quick = turning_speed(local, FPS) > ARM_SPEED.fastest
            if not quick.any():
                break
            local = _spread(local, quick)
            out[:, j] = chest @ local
    return out


def _spread(
    R: Float[np.ndarray, "frames 3 3"], quick: Bool[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 3 3"]:
    near = maximum_filter1d(quick.astype(float), round(4 * ARM_SPEED.width))
    weight = gaussian_filter1d(near, ARM_SPEED.width, mode="nearest")[:, None, None]
    mean = gaussian_filter1d(R, ARM_SPEED.width, axis=0, mode="nearest")
    return nearest_rotation((1 - weight) * R + weight * mean)
