"""Which hand holds a prop where and when, and the posture meanwhile."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True)
class Hold:
    """One palm on one place of the prop, from one frame to another."""

    hand: int
    """0 left, 1 right."""
    first: int
    """First frame in contact."""
    last: int
    """One past the last frame in contact."""
    point: Float[np.ndarray, " 3"]
    """On the surface, prop frame, metres."""
    inward: Float[np.ndarray, " 3"]
    """From the palm into the surface, unit length."""
    fingers: Float[np.ndarray, " 3"] | None = None
    """Direction of the fingers, prop frame; None lets them follow the forearm."""
    reach: int = 0
    """Frames in which the hand comes; 0 for a hand that is there from the start."""
    release: int = 0
    """Frames in which the hand goes; 0 for a hand that stays to the end."""


@dataclass(frozen=True)
class Handling:
    """The prop's motion and how it is held."""

    T_world_prop: Float[np.ndarray, "frames 4 4"]
    holds: tuple[Hold, ...]

    @property
    def held(self) -> Bool[np.ndarray, "frames 2"]:
        """Which hand is on the prop."""
        return contact_of(self.holds, len(self.T_world_prop))


def contact_of(holds: Sequence[Hold], frames: int) -> Bool[np.ndarray, "frames 2"]:
    """Which hand is in contact in which frame."""
    contact = np.zeros((frames, 2), bool)
    for hold in holds:
        contact[max(hold.first, 0) : hold.last, hold.hand] = True
    return contact


@dataclass(frozen=True)
class Posture:
    """A person's habits in one clip; angles in radians, lengths in metres."""

    squat: float = 0.5
    """How low things are reached: 0 by bending the back, 1 by bending the knees, 2 sitting on the heels."""
    lean: float = 0.0
    """Forward lean of the trunk while holding."""
    shift: float = 0.0
    """How far the pelvis is ahead of where it would stand upright, while holding."""
    crouch: float = 0.0
    """How much lower it is."""
    comfort: float = 0.93
    """Share of the straight arm that is reached with; for anything farther the trunk bends."""
    twist: float = 1.0
    """How much the chest turns toward the hands: 0 not at all, 1 squarely."""
