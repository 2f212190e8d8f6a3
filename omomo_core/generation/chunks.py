"""Chunks: the stretches of a take that are generated at once."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from omomo_core.generation.config import ChunkSizes


@dataclass(frozen=True)
class Chunk:
    """A stretch of the take: frames `first` .. `first + len(T_world_object)`."""

    first: int
    T_world_object: Float[np.ndarray, "frames 4 4"]
    prefix_frames: int
    """How many of its first frames are fixed."""
    stop: int
    """It yields its frames `prefix_frames` .. `stop`."""
    last: bool

    @property
    def frames(self) -> int:
        """How many frames it has."""
        return len(self.T_world_object)

    def handed_on(self, context: int) -> slice:
        """Return the last frames that it yields, with which the next chunk begins."""
        return slice(self.stop - context, self.stop)


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
