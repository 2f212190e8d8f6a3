"""Pictures into video files, small animations and PNG, encoded while the next are drawn."""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Generic, TypeVar, cast

import av
import cv2
import numpy as np
from av.filter import Graph
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream
from jaxtyping import UInt8

from omomo_core.errors import InputError
from omomo_core.whole_file import whole_file

_T = TypeVar("_T")
_DEPTH = 3
"""Items that may wait; pictures are large."""
_PATIENCE = 0.1
"""Seconds after which a waiting thread looks whether it is still wanted."""


class _End:
    """The end of the items: an error, or nothing."""

    def __init__(self, error: BaseException | None) -> None:
        self.error = error


class _Belt(Generic[_T]):
    """A short queue that both sides can leave."""

    def __init__(self) -> None:
        self._items: Queue[_T | _End] = Queue(_DEPTH)
        self.left = Event()
        """Who takes the items has gone."""

    def put(self, item: _T | _End) -> bool:
        """Wait for a place; False when nobody wants it any more."""
        while not self.left.is_set():
            try:
                self._items.put(item, timeout=_PATIENCE)
                return True
            except Full:
                continue
        return False

    def take(self) -> Generator[_T]:
        """The items up to the end; the error that ended them is raised here."""
        while True:
            item = self._items.get()
            if isinstance(item, _End):
                if item.error is not None:
                    raise item.error
                return
            yield item

    def drop(self) -> None:
        """Take what is left, so that nobody waits for a place."""
        self.left.set()
        try:
            while True:
                self._items.get_nowait()
        except Empty:
            return


def ahead(items: Iterable[_T]) -> Generator[_T]:
    """The same items, made in another thread while the ones before are used.

    An error in making them is raised where they are used. When the user leaves early, making stops
    and the source is closed.
    """
    belt = _Belt[_T]()

    def make() -> None:
        error: BaseException | None = None
        try:
            for item in items:
                if not belt.put(item):
                    break
        except BaseException as problem:  # handed over, not hidden
            error = problem
        finally:
            if isinstance(items, Generator):
                items.close()
        belt.put(_End(error))

    maker = Thread(target=make, name="ahead", daemon=True)
    maker.start()
    try:
        yield from belt.take()
    finally:
        belt.drop()
        maker.join()


@contextmanager
def beside(use: Callable[[_T], None]) -> Generator[Callable[[_T], None]]:
    """A function that hands items to `use`, which works on them in another thread, in order.

    The block ends when all are done. An error in `use` is raised at the next item, or at the end.
    """
    belt, failed = _Belt[_T](), list[BaseException]()

    def work() -> None:
        try:
            for item in belt.take():
                use(item)
        except BaseException as problem:  # handed over, not hidden
            failed.append(problem)
            belt.drop()

    def give(item: _T) -> None:
        if not belt.put(item):
            raise failed[0]

    worker = Thread(target=work, name="beside", daemon=True)
    worker.start()
    try:
        yield give
        belt.put(_End(None))
    except BaseException:
        belt.put(_End(None))
        raise
    finally:
        worker.join()
    if failed:
        raise failed[0]


RGB = UInt8[np.ndarray, "h w 3"]
_TICK = Fraction(1, 100)
"""What GIF counts time in, seconds."""
Convert = Callable[[RGB], av.VideoFrame]
"""Makes of a picture what the encoder takes."""


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
        InputError: there is no frame, a frame has another size than the first, the path is a folder,
            or the disk is full.
    """
    options: dict[str, object] = {"crf": str(crf), "preset": "veryfast"}
    return _write(path, frames, fps, ("mp4", {"movflags": "faststart"}), ("libx264", options))


def write_webp(path: Path, frames: Iterable[RGB], fps: float = 15.0, *, quality: int = 70) -> int:
    """Write a looping WebP animation, small enough for a web page.

    Args, returns and raises as `write_video`, but for `quality`: 0 to 100, higher is better.
    """
    return _write(
        path, frames, fps, ("webp", {"loop": "0"}), ("libwebp_anim", {"quality": str(quality)})
    )


def write_gif(path: Path, frames: Iterable[RGB], fps: float = 15.0) -> int:
    """Write a looping GIF; every picture has 256 colours of its own.

    Args, returns and raises as `write_video`; GIF counts time in hundredths of a second.
    """
    return _write(path, frames, fps, ("gif", {"loop": "0"}), ("gif", {}))


def write_moving(path: Path, frames: Iterable[RGB], fps: float) -> int:
    """Write a video or an animation by the ending of its name: .mp4, .webp or .gif.

    Args, returns and raises as `write_video`.
    """
    return {".mp4": write_video, ".webp": write_webp, ".gif": write_gif}[path.suffix](
        path, frames, fps
    )


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
    count = 0
    with whole_file(path) as partial, av.open(partial, "w", container[0], container[1]) as file:
        stream = cast(VideoStream, file.add_stream(codec[0], _rate(fps)))
        stream.options = codec[1]
        convert = _into_palette(stream, first) if codec[0] == "gif" else _into_yuv(stream, first)

        def encode(picture: RGB) -> None:
            file.mux(stream.encode(convert(picture)))

        # Whoever draws the pictures stays in this thread; OpenGL is bound to it.
        with beside(encode) as give:
            for picture in _chained(first, pictures):
                _check_size(picture, count, first.shape, path)
                give(picture)
                count += 1
        file.mux(stream.encode(None))
    return count


def _check_size(picture: RGB, number: int, first: tuple[int, ...], path: Path) -> None:
    if picture.shape != first:
        raise InputError(
            "sizes-differ",
            f"Picture {number} is {picture.shape[1]}x{picture.shape[0]}, "
            f"the first is {first[1]}x{first[0]}.",
            where=str(path),
        )


def _into_yuv(stream: VideoStream, first: RGB) -> Convert:
    """Set a stream up for yuv420p in BT.709; what turns its pictures into that."""
    height, width = first.shape[:2]
    stream.height, stream.width = height + height % 2, width + width % 2
    stream.pix_fmt = "yuv420p"
    stream.codec_context.colorspace = Colorspace.ITU709
    stream.codec_context.color_range = ColorRange.MPEG
    return _yuv


def _into_palette(stream: VideoStream, first: RGB) -> Convert:
    """Set a stream up for 256 colours; what finds them for each picture and dithers it."""
    stream.height, stream.width = first.shape[:2]
    stream.pix_fmt = "pal8"
    graph = Graph()
    source = graph.add_buffer(
        width=stream.width, height=stream.height, format=av.VideoFormat("rgb24"), time_base=_TICK
    )
    split = graph.add("split")
    palette = graph.add("palettegen", "stats_mode=single")
    use = graph.add("paletteuse", "new=1:dither=bayer:bayer_scale=4")
    sink = graph.add("buffersink")
    source.link_to(split)
    split.link_to(use, 0, 0)
    split.link_to(palette, 1, 0)
    palette.link_to(use, 0, 1)
    use.link_to(sink)
    graph.configure()
    count = 0

    def convert(picture: RGB) -> av.VideoFrame:
        nonlocal count
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        frame.pts, frame.time_base = count, _TICK
        graph.push(frame)
        flat = cast(av.VideoFrame, graph.pull())
        assert stream.average_rate is not None
        flat.pts, flat.time_base = round(count / stream.average_rate / _TICK), _TICK
        count += 1
        return flat

    return convert


def _rate(fps: float) -> Fraction:
    return Fraction(fps).limit_denominator(1001)


def _yuv(picture: RGB) -> av.VideoFrame:
    h, w = picture.shape[:2]
    if h % 2 or w % 2:
        picture = np.pad(picture, ((0, h % 2), (0, w % 2), (0, 0)), mode="edge")
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
    return frame.reformat(format="yuv420p", dst_colorspace=Colorspace.ITU709)


def _chained(first: RGB, others: Iterator[RGB]) -> Iterator[RGB]:
    yield first
    yield from others


def write_png(path: Path, picture: UInt8[np.ndarray, "h w 3"]) -> None:
    """Write an RGB picture.

    Raises:
        InputError: those of `whole_file`.
    """
    _, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    with whole_file(path) as partial:
        partial.write_bytes(data.tobytes())


def contact_sheet(
    pictures: Sequence[UInt8[np.ndarray, "h w 3"]], columns: int, *, gap: int = 4
) -> UInt8[np.ndarray, "sheet_h sheet_w 3"]:
    """Pictures of one size side by side, row by row, on white; `gap` in pixels.

    Raises:
        InputError: there is no picture.
    """
    if not pictures:
        raise InputError("no-frames", "There is no picture for the sheet.")
    h, w = pictures[0].shape[:2]
    columns = min(columns, len(pictures))
    rows = -(-len(pictures) // columns)
    sheet = np.full((rows * (h + gap) - gap, columns * (w + gap) - gap, 3), 255, np.uint8)
    for k, picture in enumerate(pictures):
        top, left = k // columns * (h + gap), k % columns * (w + gap)
        sheet[top : top + h, left : left + w] = picture
    return sheet
