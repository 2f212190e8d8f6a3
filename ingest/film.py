"""A video as frames that are asked for: found by their stamps, decoded from the key frame before."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer


def stamps_of(path: Path) -> list[int]:
    """The stamp of each frame in the order of showing, without decoding one.

    Raises:
        av.error.FFmpegError, IndexError: no video can be read.
    """
    with av.open(str(path)) as container:
        return sorted(pts for pts, _ in _packets(container))


def size_of(container: InputContainer) -> tuple[int, int]:
    """Width and height of the pictures of a video, as its header says.

    Raises:
        IndexError: it has no video, or one whose coding is not known.
    """
    stream = container.streams.video[0]
    # A stream of an unknown coding has no pictures, and so no size.
    if getattr(stream, "codec_context", None) is None:
        raise IndexError("its coding is not known")
    return stream.width, stream.height


def frames_of(path: Path, wanted: Sequence[int]) -> Iterator[tuple[int, av.VideoFrame]]:
    """Frames by their place in the order of showing, in rising order.

    Only the stretches from a key frame to a wanted frame are decoded, one frame at a time.

    Raises:
        av.error.FFmpegError, IndexError: no video can be read, or not as far.
    """
    with av.open(str(path)) as container:
        packets = _packets(container)
    stamps = sorted(pts for pts, _ in packets)
    keys = np.array(sorted(pts for pts, key in packets if key))
    place = {stamps[k]: k for k in wanted if 0 <= k < len(stamps)}
    if not place:
        return
    asked = sorted(place)
    key_of = keys[(np.searchsorted(keys, asked, "right") - 1).clip(0)]
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        for key in np.unique(key_of).tolist():
            group = {pts for pts, own in zip(asked, key_of, strict=True) if own == key}
            container.seek(key, stream=stream)
            for frame in container.decode(stream):
                if frame.pts in group:
                    yield place[frame.pts], frame
                if frame.pts is not None and frame.pts >= max(group):
                    break


def _packets(container: InputContainer) -> list[tuple[int, bool]]:
    return [(p.pts, p.is_keyframe) for p in container.demux(video=0) if p.pts is not None]
