"""A film in a file: what it says of itself, its frames by place, and which image of a log each of them is."""

from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, cast

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.sidedata.sidedata import SideData, Type
from jaxtyping import Float64, Int64

from omomo_core.errors import InputError, reading

_FAULTS = (FFmpegError, LookupError, OSError, ValueError)
"""What PyAV raises on a damaged file: of a byte in a title, too, it makes an error of text."""


@dataclass(frozen=True)
class Turning:
    """What a film says of how it is to be shown."""

    turns: int = 0
    """Quarter turns counter-clockwise, after it has been mirrored."""
    mirrored: bool = False
    """Whether left and right of the stored picture change places, as front cameras' films have it."""


@dataclass(frozen=True)
class Film:
    """What the file of a film states; but for its first picture nothing has been decoded."""

    path: Path
    stamps: tuple[int, ...]
    """One of each frame in the order of showing, in units of `tick`."""
    tick: float
    """Seconds."""
    size: tuple[int, int]
    """Width and height of the stored pictures."""
    turning: Turning
    stated: int
    """Frames that its index or its length says it has; 0 where they say nothing."""
    cut: tuple[int, int] = (0, 0)
    """Frames before and after these that it still holds and says not to show, as a phone trims a film."""

    @property
    def times(self) -> Float64[np.ndarray, " frames"]:
        """Seconds of the frames, as it stamps them."""
        return np.array(self.stamps, np.float64) * self.tick

    @property
    def upright_turns(self) -> int:
        """Quarter turns counter-clockwise that bring stored pictures upright, nothing mirrored.

        A mirrored film shows what a mirror would: the camera saw it the other way round.
        """
        # Turning what is mirrored by q quarters shows it as turning what is not by -q does.
        return (-self.turning.turns if self.turning.mirrored else self.turning.turns) % 4

    def turns_for(self, size: tuple[int, int] | None) -> int:
        """Quarter turns after which pictures have the shape of a camera's: those as players show them, or 0.

        Args:
            size: width and height that a camera was calibrated for, where known.
        """
        if size is None or self.turning.turns % 2 == 0:
            return 0
        stored, shown = (
            abs(np.log(a / b * size[1] / size[0])) for a, b in (self.size, self.size[::-1])
        )
        return self.upright_turns if shown < stored else 0


def film_at(path: Path) -> Film:
    """Look at a film.

    Raises:
        InputError: "no-video".
    """
    with opened(path) as container:
        stream = container.streams.video[0]
        # A stream of an unknown coding has no pictures, and so no size.
        if getattr(stream, "codec_context", None) is None:
            raise unreadable(path, "its coding is not known here")
        size, tick, stated = (stream.width, stream.height), float(stream.time_base or 0), 0
        rate = float(stream.average_rate or 0)
        length = (stream.duration or 0) * tick or (container.duration or 0) / av.time_base
        packets = _packets(container)
        stamps = tuple(sorted(p.pts for p in packets if p.shown))
        hidden = [p.pts for p in packets if not p.shown]
        stated = stream.frames or round(length * rate)
    if not stamps or min(size) <= 0:
        raise unreadable(path, "it holds no pictures")
    cut = sum(pts < stamps[0] for pts in hidden), sum(pts > stamps[-1] for pts in hidden)
    return Film(path, stamps, tick, size, _turning(path), max(0, stated - sum(cut)), cut)


@contextmanager
def opened(path: Path) -> Generator[InputContainer]:
    """The open file of a film.

    Raises:
        InputError: "no-video" where it cannot be opened, or where reading in the block fails.
    """
    refused = reading(lambda why: unreadable(path, why), words=_reason, faults=_FAULTS)
    with refused, av.open(str(path), metadata_errors="replace") as container:
        if not container.streams.video:
            raise unreadable(path, "it holds no pictures")
        yield container


def _reason(problem: Exception) -> str:
    if isinstance(problem, FileNotFoundError):
        return "there is no such file"
    if isinstance(problem, PermissionError):
        return "it may not be read"
    if isinstance(problem, IsADirectoryError):
        return "it is a folder"
    return "it is damaged, or no film"


def unreadable(path: Path, why: str) -> InputError:
    """The refusal of a film."""
    return InputError(
        "no-video",
        f"{path.name} cannot be read as a film: {why}.",
        where=str(path),
        fix="Give a film such as MP4 or MOV that a player shows to its end.",
    )


def _turning(path: Path) -> Turning:
    """What the matrix beside the first picture says; a film that cannot be decoded says nothing."""
    try:
        with av.open(str(path), metadata_errors="replace") as container:
            frame = next(container.decode(video=0), None)
            beside = [] if frame is None else cast(list[SideData], list(frame.side_data))
            data = next((d for d in beside if d.type == Type.DISPLAYMATRIX), None)
            return Turning() if data is None else turning_of(np.frombuffer(bytes(data), "<i4"))
    except _FAULTS:
        return Turning()


def turning_of(matrix: Int64[np.ndarray, "9"] | np.ndarray) -> Turning:
    """How a display matrix turns and mirrors, to the quarter turn.

    Args:
        matrix: of MP4 and MOV (ISO 14496-12, 6.2.2): a b u c d v x y w take a pixel to a x + c y, b x + d y.
    """
    if len(matrix) != 9:
        return Turning()
    a, b, c, d = (float(matrix[k]) for k in (0, 1, 3, 4))
    if not (a or b):
        return Turning()
    mirrored = a * d - b * c < 0
    sign = -1.0 if mirrored else 1.0
    return Turning(round(float(np.arctan2(-sign * b, sign * a)) / (np.pi / 2)) % 4, mirrored)


def frames_of(path: Path, wanted: Sequence[int]) -> Iterator[tuple[int, av.VideoFrame]]:
    """Frames by their place in the order of showing, in rising order.

    Only the stretches from a key frame to a wanted frame are decoded, one frame at a time. Damaged
    frames are left out.

    Raises:
        InputError: "no-video" where it cannot be read, or not as far.
    """
    with opened(path) as container:
        packets = _packets(container)
    stamps = sorted(p.pts for p in packets if p.shown)
    keys = np.array(sorted(p.pts for p in packets if p.key) or stamps[:1])
    place = {stamps[k]: k for k in wanted if 0 <= k < len(stamps)}
    if not place:
        return
    asked = sorted(place)
    key_of = keys[(np.searchsorted(keys, asked, "right") - 1).clip(0)]
    with opened(path) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        for key in np.unique(key_of).tolist():
            group = {pts for pts, own in zip(asked, key_of, strict=True) if own == key}
            container.seek(key, stream=stream)
            for frame in _decoded(container):
                if frame.pts in group:
                    yield place[frame.pts], frame
                if frame.pts is not None and frame.pts >= max(group):
                    break


def _decoded(container: InputContainer) -> Iterator[av.VideoFrame]:
    """The frames from where the file stands, without those that are damaged."""
    for packet in container.demux(video=0):
        try:
            frames = packet.decode()
        except _FAULTS:
            continue
        yield from frames


class _Packet(NamedTuple):
    pts: int
    key: bool
    shown: bool
    """False for what an edit list says not to show: others need it to be decoded."""


def _packets(container: InputContainer) -> list[_Packet]:
    found: list[_Packet] = []
    try:
        for packet in container.demux(video=0):
            if packet.pts is not None:
                found.append(_Packet(packet.pts, packet.is_keyframe, not packet.is_discard))
    except _FAULTS:
        # A film that ends too early holds what comes before.
        if not found:
            raise
    return found


def check_decodes(film: Film) -> None:
    """Decode its first, middle and last picture.

    Raises:
        InputError: "no-video" naming the picture that is damaged.
    """
    last = len(film.stamps) - 1
    wanted = {"first": 0, "middle": last // 2, "last": last}
    for name, place in wanted.items():
        try:
            good = any(True for _ in frames_of(film.path, [place]))
        except InputError:
            good = False
        if not good:
            raise unreadable(film.path, f"its {name} picture is damaged")


_FIT = 0.35
"""Part of the usual step between images by which a frame may be off the image that it is."""
_SAME_RATE = 0.1
"""Part by which the steps of a film and of a log that does not count its images may differ."""
_UNEVEN = 0.1
"""Part of the usual step by which the steps of a film vary that does not just count its frames."""
_FEWEST, _MOST_STARTS = 8, 100
"""Frames that tell such a film apart, and images of the log with which it is tried to begin."""
_SLACK = 0.05
"""Seconds that pictures may be off where nothing says which few are missing."""


@dataclass(frozen=True)
class FilmPairs:
    """Which frame of a film is which image of a log."""

    frames: Int64[np.ndarray, " pairs"]
    """Places in the film, rising."""
    images: Int64[np.ndarray, " pairs"]
    """Places among the images of the log, rising."""
    lost: int
    """Images of the log that the film has no frame of."""
    spare: int
    """Frames that are no image of the log."""


def pairs_of(
    film: Film,
    times: Float64[np.ndarray, " images"],
    numbers: Int64[np.ndarray, " counted"] | None = None,
) -> FilmPairs:
    """Pair the frames of a film with the images that a log lists.

    As many frames as images, without a gap, are in step. Otherwise the stamps of the film tell: they are
    the times of the images, or they count them, so that a gap shows what is missing.

    Args:
        film: of the log.
        times: of its images, seconds.
        numbers: of its images, where the log counts them; without, 0, 1, 2 and so on.

    Raises:
        InputError: "film-unpaired" where nothing says which frame is which image.
    """
    count, (before, after) = len(film.stamps), film.cut
    if before or after:
        if before + count + after != len(times):
            raise _unpaired(film, len(times))
        return _paired(np.arange(before, before + count), len(times), count)
    own = film.times - film.times[0]
    step = _usual_step(own)
    places = _counted(own, step)
    even = places[-1] == count - 1
    number, states = np.arange(len(times)), False
    if numbers is not None and len(numbers) == len(times) > 0:
        states = bool((np.diff(numbers) > 0).all()) and int(numbers[0]) >= 0
        number = numbers if states else number
    if even and count == len(times):
        return _paired(np.arange(count), len(times), count)
    if (by_time := _by_unevenness(own, times, step)) is not None:
        return _paired(by_time, len(times), count)
    total = int(number[-1]) + 1 if len(number) else 0
    missing = total - int(places[-1]) - 1
    start = round(film.times[0] / step) if step > 0 else 0
    start = start if 0 < start <= missing else 0
    if even and missing == 1 and film.times[0] >= 0:
        start = 1  # Stray Scanner stamps its first frame before zero, and some tools drop it.
    elif not (even or states) and (by_time := _by_time(own + start * step, times)) is not None:
        return _paired(by_time, len(times), count)
    same = states or _same_rate(step, times, number)
    if not same and (by_time := _by_time(own, times)) is not None:
        return _paired(by_time, len(times), count)
    unsure = even and start == 0 and not (states and missing < 0)
    if not same or (unsure and not _known_end(film, missing, step)):
        raise _unpaired(film, len(times))
    at = np.searchsorted(number, places + start).clip(max=max(0, len(number) - 1))
    return _paired(np.where(number[at] == places + start, at, -1), len(times), count)


def _by_unevenness(
    own: Float64[np.ndarray, " frames"], times: Float64[np.ndarray, " images"], step: float
) -> Int64[np.ndarray, " frames"] | None:
    """The image of each frame of a film that is uneven as its log is, wherever it begins; else None."""
    if step <= 0 or len(own) < _FEWEST or float(np.diff(own).std()) < _UNEVEN * step:
        return None
    best: tuple[float, Int64[np.ndarray, " frames"] | None] = (_UNEVEN * step / 2, None)
    for start in range(min(max(0, len(times) - len(own)), _MOST_STARTS) + 1):
        at = own + (times[start] - times[0])
        if (image := _by_time(at, times)) is not None:
            known = image >= 0
            off = float(np.abs(at[known] - (times[image[known]] - times[0])).max())
            best = min(best, (off, image), key=lambda found: found[0])
    return best[1]


def _paired(image: Int64[np.ndarray, " frames"], images: int, count: int) -> FilmPairs:
    """The pairs from the image of each frame, -1 for none."""
    frames = np.flatnonzero(image >= 0)
    return FilmPairs(frames, image[frames], images - len(frames), count - len(frames))


def _usual_step(times: Float64[np.ndarray, " frames"]) -> float:
    steps = np.diff(times)
    steps = steps[steps > 0]
    if not len(steps):
        return 0.0
    usual = float(np.median(steps))
    near = steps[np.abs(steps - usual) < 0.5 * usual]
    return float(near.mean()) if len(near) else usual  # stamps of whole milliseconds are uneven


def _counted(times: Float64[np.ndarray, " frames"], step: float) -> Int64[np.ndarray, " frames"]:
    """Numbers of frames from 0 that are a step apart, with gaps where the film has gaps."""
    if step <= 0:
        return np.arange(len(times))
    apart = np.maximum(np.rint(np.diff(times) / step).astype(np.int64), 1)
    return np.concatenate([[0], np.cumsum(apart)])


def _by_time(
    own: Float64[np.ndarray, " frames"], times: Float64[np.ndarray, " images"]
) -> Int64[np.ndarray, " frames"] | None:
    """The image at the time of each frame, -1 for frames beyond the log; None where they do not fit."""
    if len(times) < 2:
        return None
    log = times - times[0]
    slack = _FIT * float(np.median(np.diff(log)))
    inside = own <= log[-1] + slack
    after = np.searchsorted(log, own[inside]).clip(1, len(log) - 1)
    nearest = after - (own[inside] - log[after - 1] < log[after] - own[inside])
    fits = (np.abs(log[nearest] - own[inside]) <= slack).all() and (np.diff(nearest) > 0).all()
    if not fits or inside.mean() < 0.5:
        return None
    image = np.full(len(own), -1)
    image[inside] = nearest
    return image


def _same_rate(
    step: float, times: Float64[np.ndarray, " images"], number: Int64[np.ndarray, " images"]
) -> bool:
    """Whether the film's frames are as far apart as the images of the log."""
    if len(times) < 2 or step <= 0:
        return False
    log = float(np.median(np.diff(times) / np.maximum(np.diff(number), 1)))
    return abs(step / max(log, 1e-9) - 1) <= _SAME_RATE


def _known_end(film: Film, missing: int, step: float) -> bool:
    """Whether a film without a gap, from 0 on, is known to lack (or, below 0, to have more of) the end.

    It is where its index or its length tells of frames that it does not hold, or where all that may be
    wrong is a few hundredths of a second.
    """
    cut = film.stated >= len(film.stamps) + missing > len(film.stamps)
    return abs(missing) * step <= _SLACK or cut


def _unpaired(film: Film, images: int) -> InputError:
    return InputError(
        "film-unpaired",
        f"{film.path.name} has {len(film.stamps)} frames and the log {images} images, and the film's stamps "
        "do not tell which frame is which image.",
        where=str(film.path),
        fix="Give the film as the app wrote it, not one that was cut or converted.",
    )
