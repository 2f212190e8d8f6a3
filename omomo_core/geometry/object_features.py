"""Features of an object over time: its basis-point encoding (BPS, Prokudin et al. 2019) and its centre.

Prokudin et al. 2019, used as in OMOMO section 3.1: the basis is centred on the object but keeps the
axes of the world, so that the code shows how the object is turned.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

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


BASIS_RADIUS = 1.0
PAPER_POINTS = 1024


@lru_cache(maxsize=4)
def basis(count: int = PAPER_POINTS) -> Float[np.ndarray, "count 3"]:
    """The first `count` of the 1,024 published basis points, uniform in the unit ball, metres."""
    # The published file is this seed and recipe to the last digit, so it need not be shipped.
    random = np.random.RandomState(13)
    direction = random.normal(size=(PAPER_POINTS, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return (direction * random.uniform(size=(PAPER_POINTS, 1)) ** (1 / 3) * BASIS_RADIUS)[:count]


def encode(
    tree: KDTree,
    centre: Float[np.ndarray, "3"],
    R_world_object: Float[np.ndarray, "frames 3 3"],
    count: int = PAPER_POINTS,
) -> Float[np.ndarray, "frames count 3"]:
    """Vectors (world axes, metres) from each basis point to the nearest indexed point.

    Args:
        tree: index over the object's points, in the object's frame.
        centre: where the basis sits, in the object's frame.
        R_world_object: the object's orientation per frame.
        count: how many basis points to use.

    One tree serves all frames because the basis is turned into the object instead of the object
    into the world. Frames of one orientation are looked up once: samples often see the same object.
    """
    R, same = np.unique(R_world_object, axis=0, return_inverse=True)
    query = basis(count) @ R + centre
    _, nearest = tree.query(query.reshape(-1, 3))
    offset_object = np.asarray(tree.data)[nearest].reshape(query.shape) - query
    return (offset_object @ R.swapaxes(-1, -2))[same.reshape(-1)]
