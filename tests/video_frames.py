"""Single frames of a video that a test wrote."""

from collections.abc import Sequence
from pathlib import Path

import av

from render.video import RGB


def read_frames(path: Path, indices: Sequence[int]) -> list[RGB]:
    """The video's frames at `indices`, in that order.

    Raises:
        IndexError: the video has not that many frames.
    """
    with av.open(str(path)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    return [frames[index] for index in indices]
