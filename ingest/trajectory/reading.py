"""What a user may say about a take that its log does not, or not rightly."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Reading:
    """What whoever recorded a take knows better than its log."""

    floor: float | None = None
    """Height of the floor above the session's origin, metres, along up (negative when it is below
    the place where the session started); None finds it."""
    up: tuple[float, float, float] | None = None
    """Up in the session's world; None trusts or finds it."""
    stitch: bool = False
    """Move what follows a tracking jump back to where it belongs, instead of splitting there."""
    closure: bool = False
    """The object ends on the mark where it began: the drift in between is taken out."""


AS_LOGGED = Reading()
"""Nothing is said."""
