"""Tipping effort: the force that holds up an object which stands on one edge.

A hand keeps it from falling by lifting it beyond that edge, the farther the lighter, or, where it is tall, by
pushing its top across; the floor's friction bounds that push.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from omomo_core.contact.static_stability import Overhang, overhang
from omomo_core.contact.support import OVERHANG, REACH
from omomo_core.geometry.object_features import ObjectFeatures

FRICTION = 0.4
"""Coefficient of friction of wood, metal or plastic on a floor."""
SHORTEST = 15
"""An object that is tipped in fewer frames does not tell from which side it is held."""
_LEAST = 0.02
"""Shortest lever arm, metres."""


@dataclass(frozen=True)
class TippingLever:
    """The frames in which somebody holds up an object that stands on an edge."""

    frames: Int[np.ndarray, " tipped"]
    overhang: Overhang
    """The overhang in those frames."""

    def effort(
        self,
        palms: Float[np.ndarray, "samples tipped 2 3"],
        held: Bool[np.ndarray, "samples tipped 2"],
    ) -> Float[np.ndarray, " samples"]:
        """Return the mean force that holds it up, as a share of its weight; NaN with too few held frames.

        Args:
            palms: left and right, in the object's frame, metres.
            held: which of them hold it.
        """
        out = (
            np.einsum("kthi,ti->kth", palms, self.overhang.direction) - self.overhang.edge[:, None]
        )
        high = np.einsum("kthi,ti->kth", palms, self.overhang.up) - self.overhang.floor[:, None]
        arm = np.where(held, np.maximum(out, FRICTION * high), -np.inf).max(axis=2)
        force = self.overhang.metres / arm.clip(_LEAST)
        by_hand = held.any(axis=2)
        count = by_hand.sum(axis=1)
        total = np.where(by_hand, force, 0).sum(axis=1)
        return np.where(count < SHORTEST, np.nan, total / count.clip(1))


def tipping_lever(
    take: ObjectFeatures, must_hold: Bool[np.ndarray, " frames"]
) -> TippingLever | None:
    """Return the frames in which an object stands on an edge and is held up; None if there are too few.

    Args:
        take: the object and its motion.
        must_hold: frames in which somebody must hold it.
    """
    frames = np.flatnonzero(must_hold & (take.lowest < REACH))
    falls = overhang(take, frames)
    kept = falls.metres > OVERHANG
    if kept.sum() < SHORTEST:
        return None
    return TippingLever(frames[kept], falls.at(kept))
