"""A take at two sizes: as it is, and as it would be for a person of the networks' stature."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from omomo_core.generation.scores import must_be_held
from omomo_core.generation.take import Take, prepare
from omomo_core.motion import ObjectMotion


@dataclass(frozen=True)
class Scene:
    """Another person's height is the same scene scaled: scale in, sample, scale out."""

    take: Take
    """In metres."""
    trained: Take
    """Every length times `scale`."""
    scale: float
    moving: Bool[np.ndarray, " frames"]
    """Frames in which somebody must hold the object."""


def scene_of(motion: ObjectMotion, height: float, trained_height: float) -> Scene:
    """Prepare a motion for a person of `height`, metres, and networks trained on `trained_height`."""
    scale = trained_height / height
    take = prepare(motion)
    T = motion.T_world_object.copy()
    T[:, :3, 3] *= scale
    mesh = replace(motion.mesh, vertices=motion.mesh.vertices * scale)
    trained = prepare(replace(motion, mesh=mesh, T_world_object=T))
    return Scene(take, trained, scale, must_be_held(take))
