"""Pictures into H.264 files and small animations, and back."""

import os
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.error import FFmpegError
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream
from jaxtyping import UInt8

from omomo_core.errors import InputError

RGB = UInt8[np.ndarray, "h w 3"]


def write_video(path: Path, frames: Iterable[RGB], fps: float = 30.0, *, crf: int = 20) -> int:
    """Write an MP4 that plays everywhere: H.264, yuv420p, BT.709, index at the front.

    H.264 wants even sizes: an odd last row or column is doubled. The file appears under its name
    only when it is complete.

    Args:
        path: of the MP4; its folder must exist.
        frames: pictures of one size.
        fps: frames a second.
        crf: quality, lower is better and larger.

    Returns:
        The number of frames.

    Raises:
        InputError: there is no frame, or a frame has another size than the first.
    """
    options: dict[str, object] = {"crf": str(crf), "preset": "medium"}
    return _write(path, frames, fps, ("mp4", {"movflags": "faststart"}), ("libx264", options))


def write_webp(path: Path, frames: Iterable[RGB], fps: float = 15.0, *, quality: int = 70) -> int:
    """Write a looping WebP animation, small enough for a web page.

    Args, returns and raises as `write_video`, but for `quality`: 0 to 100, higher is better.
    """
    return _write(
        path, frames, fps, ("webp", {"loop": "0"}), ("libwebp_anim", {"quality": str(quality)})
    )


def read_frames(path: Path, indices: Sequence[int]) -> list[RGB]:
    """The video's frames at `indices`, in that order.

    Raises:
        InputError: the file holds no video, or not that many frames.
    """
    found: dict[int, RGB] = {}
    try:
        with av.open(str(path)) as container:
            for index, frame in enumerate(container.decode(video=0)):
                if index in indices:
                    found[index] = frame.to_ndarray(format="rgb24")
                if index >= max(indices):
                    break
        return [found[i] for i in indices]
    except (FFmpegError, IndexError) as error:
        raise InputError("no-video", f"No video can be read: {error}.", where=str(path)) from error
    except KeyError as missing:
        what = f"The video has no frame {missing}."
        raise InputError("no-such-frame", what, where=str(path)) from missing


def _write(
    path: Path,
    frames: Iterable[RGB],
    fps: float,
    container: tuple[str, dict[str, str]],
    codec: tuple[str, dict[str, object]],
) -> int:
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise InputError("no-frames", "There is no picture to write.", where=str(path))
    size = first.shape
    count = 0
    with _complete(path) as partial, av.open(partial, "w", container[0], container[1]) as file:
        stream = cast(VideoStream, file.add_stream(codec[0], _rate(fps)))
        stream.height, stream.width = size[0] + size[0] % 2, size[1] + size[1] % 2
        stream.pix_fmt = "yuv420p"
        stream.options = codec[1]
        stream.codec_context.colorspace = Colorspace.ITU709
        stream.codec_context.color_range = ColorRange.MPEG
        for picture in _chained(first, pictures):
            if picture.shape != size:
                raise InputError(
                    "sizes-differ",
                    f"Picture {count} is {picture.shape[1]}x{picture.shape[0]}, "
                    f"the first is {size[1]}x{size[0]}.",
                    where=str(path),
                )
            file.mux(stream.encode(_yuv(picture)))
            count += 1
        file.mux(stream.encode(None))
    return count


def _rate(fps: float) -> Fraction:
    return Fraction(fps).limit_denominator(1001)


def _yuv(picture: RGB) -> av.VideoFrame:
    h, w = picture.shape[:2]
    even = np.pad(picture, ((0, h % 2), (0, w % 2), (0, 0)), mode="edge")
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
    return frame.reformat(format="yuv420p", dst_colorspace=Colorspace.ITU709)


def _chained(first: RGB, others: Iterator[RGB]) -> Iterator[RGB]:
    yield first
    yield from others


@contextmanager
def _complete(path: Path) -> Generator[str]:
    """A temporary name beside `path` that becomes `path` when all went well, and is gone if not."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        yield str(partial)
        with partial.open("rb") as written:
            os.fsync(written.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
