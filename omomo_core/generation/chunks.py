"""A take of any length, cut into chapters that overlap: what comes in as poses, one after another."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class ChunkSizes:
    """How a take is cut.

    Every chapter begins with frames that the one before has decided (`context`) and ends with frames that
    the one after will decide again, with more of the future in view (`margin`).
    """

    length: int
    """Frames of a chapter."""
    context: int
    margin: int
    spare: int
    """A rest of the take that is no longer than this is added to its last chapter."""


RECORDED = ChunkSizes(length=600, context=30, margin=30, spare=120)
"""For takes that are there as a whole: twenty seconds at a time."""
LIVE = ChunkSizes(length=120, context=60, margin=20, spare=0)
"""For poses that still arrive: the newest motion is at most two seconds behind them."""


@dataclass(frozen=True)
class Chunk:
    """Frames `first` .. `first + len(T_world_object)` of the take."""

    first: int
    T_world_object: Float[np.ndarray, "frames 4 4"]
    prefix_frames: int
    """So many of its first frames are decided already."""
    stop: int
    """It decides its frames `decided` .. `until`."""
    last: bool


def split_into_chunks(
    poses: Iterable[Float[np.ndarray, "4 4"]], how: ChunkSizes
) -> Iterator[Chunk]:
    """Chapters as soon as their poses are there; every frame is decided by exactly one."""
    held: list[Float[np.ndarray, "4 4"]] = []
    first = prefix_frames = 0
    for pose in poses:
        held.append(pose)
        if len(held) <= how.length + how.spare:
            continue
        stop = how.length - how.margin
        yield Chunk(first, np.stack(held[: how.length]), prefix_frames, stop, last=False)
        gone = stop - how.context
        del held[:gone]
        first, prefix_frames = first + gone, how.context
    if len(held) > prefix_frames:
        yield Chunk(first, np.stack(held), prefix_frames, len(held), last=True)
