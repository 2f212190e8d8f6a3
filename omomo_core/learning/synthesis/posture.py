"""How one person holds the body while the hands work."""

from dataclasses import dataclass


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
