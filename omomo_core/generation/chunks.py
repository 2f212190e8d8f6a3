"""Chunks: a take of any length is split into overlapping chunks while its poses arrive."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class ChunkSizes:
    """Sizes of chunks, frames.

    Every chunk begins with frames that the chunk before has fixed (`context`) and ends with frames that the
    chunk after generates again with more of the future in view (`margin`).
    """

    length: int
    """Frames of a chunk."""
    context: int
    margin: int
    spare: int
    """A rest of the take that is no longer than this is added to its last chunk."""


RECORDED = ChunkSizes(length=600, context=30, margin=30, spare=120)
"""For takes that are complete: twenty seconds at a time."""
LIVE = ChunkSizes(length=120, context=60, margin=20, spare=0)
"""For poses that still arrive: the newest motion is at most two seconds behind them."""


@dataclass(frozen=True)
class Chunk:
    """Frames `first` .. `first + len(T_world_object)` of the take."""

    first: int
    T_world_object: Float[np.ndarray, "frames 4 4"]
    prefix_frames: int
    """How many of its first frames are fixed."""
    stop: int
    """It yields its frames `prefix_frames` .. `stop`."""
    last: bool


def split_into_chunks(
    poses: Iterable[Float[np.ndarray, "4 4"]], sizes: ChunkSizes
) -> Iterator[Chunk]:
    """Yield chunks as soon as their poses have arrived; every frame is yielded by exactly one."""
    held: list[Float[np.ndarray, "4 4"]] = []
    first = prefix_frames = 0
    for pose in poses:
        held.append(pose)
        if len(held) <= sizes.length + sizes.spare:
            continue
        stop = sizes.length - sizes.margin
        yield Chunk(first, np.stack(held[: sizes.length]), prefix_frames, stop, last=False)
        gone = stop - sizes.context
        del held[:gone]
        first, prefix_frames = first + gone, sizes.context
    if len(held) > prefix_frames:
        yield Chunk(first, np.stack(held), prefix_frames, len(held), last=True)
