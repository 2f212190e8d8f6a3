"""Curves of a phone's log along a scene, and its film as a strip of small pictures."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import av
import cv2
import numpy as np
from jaxtyping import Bool, Float64, Int, UInt8

from capture_app.inspection import Inspection
from capture_app.overlay.overlay_film import RGB, TimedPictures, open_film
from ingest.film import frames_of
from ingest.report.checked_session import CheckedSession
from ingest.report.take_report import Check
from ingest.session import CaptureSession
from ingest.trajectory.smooth import resample
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import velocity
from omomo_core.motion import FPS
from render.cameras import quarter_turns

_RATE = 5.0
"""Pictures a second."""
_WIDTH = 320
"""Pixels along the longer side."""
_MOST = 900
"""Pictures; a longer film is shown with fewer a second."""
_MOST_BYTES = 20 * 10**6
_QUALITY = 72


@dataclass(frozen=True)
class FilmStrip:
    """Small JPEGs of a film, upright."""

    times: Float64[np.ndarray, " pictures"]
    """Seconds on the clock that was asked for."""
    pictures: tuple[bytes, ...]
    size: tuple[int, int]
    """Width and height of each."""


def film_strip(session: CaptureSession, start: float, stop: float, turns: int) -> FilmStrip | None:
    """The film between two moments; None where the phone filmed nothing then.

    A film that ends in damaged pictures is shown as far as it goes.

    Args:
        session: what the phone logged.
        start: second on the session's clock that becomes 0.
        stop: second on the session's clock.
        turns: counter-clockwise quarter turns that bring up to the top.
    """
    try:
        film = open_film(session)
    except InputError:
        return None
    indices = _wanted(film.times, start, stop)
    times: list[float] = []
    pictures: list[bytes] = []
    size, total = (0, 0), 0
    for index, picture in _small(session, film, indices):
        upright = np.ascontiguousarray(np.rot90(picture, turns))
        jpeg = _jpeg(upright)
        total += len(jpeg)
        if total > _MOST_BYTES:
            break
        size = (upright.shape[1], upright.shape[0])
        times.append(float(film.times[index] - start))
        pictures.append(jpeg)
    return FilmStrip(np.array(times), tuple(pictures), size) if pictures else None


def _wanted(
    times: Float64[np.ndarray, " images"], start: float, stop: float
) -> Int[np.ndarray, " wanted"]:
    """Places of the pictures to show."""
    step = max(1 / _RATE, (stop - start) / _MOST)
    grid = np.arange(start, stop + 0.5 * step, step)
    nearest = np.unique(np.searchsorted(times, grid).clip(0, len(times) - 1))
    return nearest[(times[nearest] >= start - step) & (times[nearest] <= stop + step)]


def _small(
    session: CaptureSession, film: TimedPictures, indices: Int[np.ndarray, " wanted"]
) -> Iterator[tuple[int, RGB]]:
    """The wanted pictures in the phone's landscape, made small, with their places; no damaged ones."""
    try:
        if session.images is not None or session.video is None:
            for index in indices.tolist():
                for place, picture in film.read(index, index + 1):
                    yield place, _shrunk(picture)
        else:
            index_of = {film.places[index]: index for index in indices.tolist()}
            for place, frame in frames_of(session.video, list(index_of)):
                picture = np.ascontiguousarray(np.rot90(_reduced(frame), session.image_turns))
                yield index_of[place], picture
    except InputError:
        return


def _reduced(frame: av.VideoFrame) -> RGB:
    """Made small before the codec's colours are turned into ours."""
    width, height = _fitted(frame.width, frame.height)
    return frame.reformat(width=width, height=height, format="rgb24").to_ndarray()


def _shrunk(picture: RGB) -> RGB:
    size = _fitted(picture.shape[1], picture.shape[0])
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _fitted(width: int, height: int) -> tuple[int, int]:
    scale = min(1.0, _WIDTH / max(width, height))
    return max(2, round(width * scale)), max(2, round(height * scale))


def _jpeg(picture: UInt8[np.ndarray, "h w 3"]) -> bytes:
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()


GOOD, LIMITED, BROKEN = 0, 1, 2
"""Tracking of a frame; broken is a jump, a gap or a pose that stands still."""


@dataclass(frozen=True)
class Recording:
    """The part of a header and the arrays that come from a phone's log."""

    header: dict[str, Any]
    """`phone`, `film`, `report` and `events`, see docs/replay.md."""
    arrays: dict[str, np.ndarray]


_NOT_FILMED = Recording({"film": None}, {})


def recording(
    inspection: Inspection, T_world_phone: Float64[np.ndarray, "frames 4 4"], first: int, film: bool
) -> Recording:
    """Return what the log tells of the frames of a scene.

    Args:
        inspection: the session, looked over.
        T_world_phone: the phone in the scene's world (z up), ARKit's camera axes.
        first: frame of the session, at 30 fps from its start, that is the scene's first.
        film: decode what the phone filmed, too.
    """
    session, frames = inspection.session, len(T_world_phone)
    look = CheckedSession(session)
    T, valid = (array[first : first + frames] for array in look.poses)
    known = np.where(valid[:, None], T[:, :3, 3], np.nan)
    # A central difference does not look at its own frame.
    speed = np.where(valid, np.linalg.norm(velocity(known, FPS), axis=1), np.nan)
    untracked = _broken(session, look.breaks.untracked)[first : first + frames]
    tracking = np.where(valid, GOOD, np.where(untracked, LIMITED, BROKEN))
    arrays = {
        "phone_speed": speed.astype(np.float32),
        "tracking": tracking.astype(np.uint8),
    }
    pictures = filmed(session, T_world_phone, first) if film else _NOT_FILMED
    header = {
        "phone": _lens(session, quarter_turns(T_world_phone)),
        "report": {"verdict": inspection.verdict, "advice": inspection.advice, "app": session.app},
        "events": _events(inspection, first, frames),
    }
    return Recording({**header, **pictures.header}, {**arrays, **pictures.arrays})


def filmed(
    session: CaptureSession, T_world_phone: Float64[np.ndarray, "frames 4 4"], first: int
) -> Recording:
    """Return what the phone filmed during the frames of a scene; decoding takes some of its length.

    Args: as `recording`. Of the header it is `film` alone.
    """
    start = float(session.times[0]) + first / FPS
    stop = start + (len(T_world_phone) - 1) / FPS
    strip = film_strip(session, start, stop, quarter_turns(T_world_phone))
    if strip is None:
        return _NOT_FILMED
    return Recording({"film": _film_header(strip)}, _film_arrays(strip))


def _broken(session: CaptureSession, steps: Bool[np.ndarray, " steps"]) -> Bool[np.ndarray, " f"]:
    """Frames at 30 fps that marked steps of the log spoil."""
    return ~resample(session.times, session.T_world_phone, steps)[1]


def _lens(session: CaptureSession, turns: int) -> dict[str, float] | None:
    """Return the lens of the landscape picture: vertical angle in radians, width / height, and the `turns`
    that bring up to its top; None where the log does not say it."""
    if session.intrinsics is None or session.image_size is None:
        return None
    width, height = session.image_size
    focal = float(np.median(session.intrinsics[:, 1]))
    fov_y = 2 * float(np.arctan(height / 2 / focal))
    return {"fov_y": fov_y, "aspect": width / height, "turns": turns}


def _film_header(strip: FilmStrip) -> dict[str, int]:
    return {"width": strip.size[0], "height": strip.size[1], "count": len(strip.pictures)}


def _film_arrays(strip: FilmStrip) -> dict[str, np.ndarray]:
    lengths = [len(picture) for picture in strip.pictures]
    return {
        "film_times": strip.times.astype(np.float32),
        "film_offsets": np.cumsum([0, *lengths]).astype(np.uint32),
        "film_jpeg": np.frombuffer(b"".join(strip.pictures), np.uint8),
    }


def _events(inspection: Inspection, first: int, frames: int) -> list[dict[str, Any]]:
    """The checks that are not fine and concern these frames."""
    checks = [check for check in inspection.report.checks if check.severity != "ok"]
    placed = [(check, _frames_of(check, inspection.session, first)) for check in checks]
    return [
        {
            "kind": "check",
            "name": check.name,
            "severity": check.severity,
            "message": check.message,
            "fix": check.fix,
            "start": None if at is None else max(at[0], 0.0),
            "stop": None if at is None else min(at[1], frames - 1.0),
        }
        for check, at in placed
        if at is None or (at[1] >= 0 and at[0] < frames)
    ]


def _frames_of(check: Check, session: CaptureSession, first: int) -> tuple[float, float] | None:
    """First and last frame of the scene that a check concerns; None for the whole take."""
    if check.frames is None:
        return None
    start, stop = check.frames
    last = min(max(stop - 1, start), len(session.times) - 1)
    seconds = session.times[[min(start, last), last]] - session.times[0]
    at = (seconds * FPS - first).round(3).tolist()
    return at[0], at[1]
