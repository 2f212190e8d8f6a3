"""What a user may say about a take that its log does not, or not rightly."""

from dataclasses import dataclass
from typing import Literal

Top = Literal["object:x", "object:y", "object:z", "object:-x", "object:-y", "object:-z"]
"""Axis of the object's mesh that points up wherever the object rests."""


@dataclass(frozen=True)
class Reading:
    """What whoever recorded a take knows better than its log."""

    floor: float | None = None
    """Height of the floor above the session's origin, metres, along up (negative when it is below
    the place where the session started); None finds it."""
    up: tuple[float, float, float] | Top | None = None
    """Up in the session's world, or the axis of the mesh that is up where the object rests; None trusts
    the log or finds it."""
    stitch: bool = False
    """Move what follows a tracking jump back to where it belongs, instead of splitting there."""
    closure: bool = False
    """The object ends on the mark where it began: the drift in between is taken out."""
    segment: int | None = None
    """Which stretch between tracking failures is used, counted from 1; None is the longest."""
    format: str | None = None
    """Name of the format to read the log as; None tells it by what it holds."""


AS_LOGGED = Reading()
"""Nothing is said."""
