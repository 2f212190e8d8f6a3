"""A body that follows a root path."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing

from omomo_core.geometry.runs import runs
from omomo_core.learning.synthesis.walker.bearing import bear
from omomo_core.learning.synthesis.walker.gait import step_along
from omomo_core.learning.synthesis.walker.library import MotionLibrary
from omomo_core.learning.synthesis.walker.path import RootPath
from omomo_core.motion import FPS

_AT_REST = 0.02
"""Metres (or 0.3 radians) per second."""


def follow(
    rng: np.random.Generator, library: MotionLibrary, path: RootPath
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Walk, step and turn along a path.

    Args:
        rng: picks how the person stands, and which foot goes first.
        library: from `index`.
        path: at rest where the person should stand.

    Returns:
        Pelvis (world, metres) and global R_world_joint at every frame of the path.
    """
    frames = len(path.heading)
    bearing = bear(rng, library.standing, runs(moving(path)), frames)
    return step_along(rng, library.body, bearing, path)


def moving(path: RootPath) -> Bool[np.ndarray, " frames"]:
    """Frames in which the path is not at rest; moments of rest between two moves do not count."""
    speed = np.linalg.norm(np.gradient(path.position, axis=0), axis=1)
    speed = (speed + np.abs(np.gradient(path.heading)) * 0.1) * FPS
    return binary_closing(speed > _AT_REST, np.ones(9, bool))
