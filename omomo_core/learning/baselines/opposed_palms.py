"""Without learning: both palms on opposite sides of the object, let go where it rests.

Which way across the object is drawn at random: nothing tells on which side the person stands.
"""

import numpy as np
from jaxtyping import Float

from omomo_core.contact.static_stability import must_be_held
from omomo_core.geometry.object_features import ObjectFeatures
from omomo_core.geometry.transforms import apply
from omomo_core.motion import HandMotion


def opposed_palms(
    take: ObjectFeatures, samples: int, random: np.random.Generator
) -> list[HandMotion]:
    """Return samples of the palms.

    Args:
        take: the object's motion.
        samples: how many guesses.
        random: draws a horizontal direction for each.

    Returns:
        Palms on the surface points farthest along and against the direction as the object lies in
        its first frame; contact where the object moves. While it rests the palms stay there: no
        body without learning says where else they would be.
    """
    held = must_be_held(take).astype(float)
    contact = np.stack([held, held], axis=1)
    return [
        HandMotion(palms=_ends(take, direction), contact=contact)
        for direction in random.uniform(0, 2 * np.pi, samples)
    ]


def _ends(take: ObjectFeatures, direction: float) -> Float[np.ndarray, "frames 2 3"]:
    T = take.motion.T_world_object
    along = take.surface.points @ T[0, :3, :3].T @ [np.cos(direction), np.sin(direction), 0.0]
    ends = take.surface.points[[int(along.argmax()), int(along.argmin())]]
    return apply(T, ends)
