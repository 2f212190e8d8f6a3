"""Features of a moving object that contacts and stages share."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from omomo_core.geometry.surface import Surface, sample_surface
from omomo_core.geometry.transforms import angular_velocity, velocity
from omomo_core.motion import FPS, ObjectMotion


@dataclass(frozen=True)
class ObjectFeatures:
    """One object motion with everything that is computed from it once."""

    motion: ObjectMotion
    surface: Surface
    centre: Float[np.ndarray, "frames 3"]
    """Mean of the surface, world, metres."""
    lowest: Float[np.ndarray, " frames"]
    velocity: Float[np.ndarray, "frames 3"]
    spin: Float[np.ndarray, "frames 3"]

    @property
    def frames(self) -> int:
        """Length of the take."""
        return len(self.centre)


def object_features(motion: ObjectMotion, surface: Surface | None = None) -> ObjectFeatures:
    """Compute the features of a motion; the surface of its mesh is sampled unless it is there already."""
    T = motion.T_world_object
    surface = surface or sample_surface(motion.mesh)
    centre = T[:, :3, :3] @ surface.centre + T[:, :3, 3]
    return ObjectFeatures(
        motion=motion,
        surface=surface,
        centre=centre,
        lowest=(surface.outline @ T[:, 2, :3].T).min(axis=0) + T[:, 2, 3],
        velocity=velocity(centre, FPS),
        spin=angular_velocity(T[:, :3, :3], FPS),
    )
