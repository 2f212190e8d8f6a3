"""Find the intervals in which the object stands on the floor, from the phone's poses alone."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from ingest.session import CaptureSession
from ingest.trajectory.breaks import check_rate, find_breaks
from ingest.trajectory.gravity import known_up, upright
from ingest.trajectory.resample import resample
from ingest.trajectory.rests import find_rests, is_steady
from ingest.trajectory.smooth import smooth
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

_WINDOW = round(FPS)
_LEVEL, _UPRIGHT = 0.012, np.radians(1.2)
"""Metres and rad by which a pushed phone's height and tilt change within a second; a carried one
bobs by 2 cm with every step, and a world that leans by half a degree rises by 1 cm in a metre."""
_PUSHED = 0.3
"""Metres that a thing is pushed at least."""
_CLIMB = 0.03
"""Metres that its height may change from one end of a push to the other: tracking drifts."""


@dataclass(frozen=True)
class Contact:
    """A stretch in which the object seems to stand, or to be pushed over the floor."""

    kind: Literal["rest", "push"]
    start: int
    stop: int
    """Frames at 30 fps."""
    down: Float64[np.ndarray, "3"]
    """Unit vector of gravity in the phone's axes, of the poses."""
    sway: Float64[np.ndarray, "3 2"]
    """How `down` changes with gravity's x and y in the world; a phone that turns sways less."""
    place: Float64[np.ndarray, "3"]
    """Of the camera, in the session's world turned z up, metres."""
    path: float
    """Metres the phone had gone by then."""

    @property
    def height(self) -> float:
        """Height of the camera over the origin of the session's world, metres."""
        return float(self.place[2])

    @property
    def when(self) -> str:
        """In seconds from the start of the take."""
        return f"{self.start / FPS:.1f} to {self.stop / FPS:.1f} s"


@dataclass(frozen=True)
class PhoneTrack:
    """The poses of a session's phone, resampled and turned z up."""

    T_zup_phone: Float64[np.ndarray, "frames 4 4"]
    """30 fps, in the session's world turned z up."""
    valid: Bool[np.ndarray, " frames"]
    T_zup_session: Float64[np.ndarray, "4 4"]


def track(session: CaptureSession) -> PhoneTrack:
    """The phone over time, where the log or the accelerometer says which way is up.

    Raises:
        InputError: "rate-too-low", "floor-gravity", "gravity-wrong".
    """
    check_rate(session)
    up = known_up(session)
    if up is None:
        raise InputError(
            "floor-gravity",
            f"{session.app} does not log which way is up, and there is no accelerometer: the floor "
            "says nothing then.",
            where=str(session.source),
            fix="Record with an app whose world is gravity aligned, such as Stray Scanner.",
        )
    broken = find_breaks(session).any
    calm = smooth(session, broken)
    T, valid = resample(calm.times, calm.T_world_phone, broken)
    T_zup_session = upright(up)
    return PhoneTrack(T_zup_session @ T, valid, T_zup_session)


def find_contacts(seen: PhoneTrack) -> list[Contact]:
    """The rests that are too steady for hands, and the level stretches between them, in order.

    A thing on a table, or carried with a steady hand, looks alike: heights tell it later.
    """
    T = seen.T_zup_phone
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1))])
    rests = find_rests(T, seen.valid)
    steady = [_contact("rest", T, gone, *span) for span in rests if is_steady(T[slice(*span)])]
    moving = seen.valid.copy()
    for start, stop in rests:
        moving[start:stop] = False
    pushed = [
        _contact("push", T, gone, start, stop)
        for start, stop in _level(T, moving)
        if np.linalg.norm(np.ptp(T[start:stop, :2, 3], axis=0)) > _PUSHED
        and np.ptp(T[start:stop, 2, 3]) < _CLIMB
    ]
    return sorted(steady + pushed, key=lambda contact: contact.start)


def _contact(
    kind: Literal["rest", "push"],
    T: Float64[np.ndarray, "frames 4 4"],
    gone: Float64[np.ndarray, " frames"],
    start: int,
    stop: int,
) -> Contact:
    world = T[start:stop, :3, :3].mean(axis=0).T
    down = -world[:, 2]
    return Contact(
        kind=kind,
        start=start,
        stop=stop,
        down=down / np.linalg.norm(down),
        sway=world[:, :2],
        place=T[start:stop, :3, 3].mean(axis=0),
        path=float(gone[(start + stop) // 2]),
    )


def _level(
    T: Float64[np.ndarray, "frames 4 4"], moving: Bool[np.ndarray, " frames"]
) -> list[tuple[int, int]]:
    """(start, stop) of the moving stretches in which height and tilt hardly change in any second."""
    if len(T) < _WINDOW:
        return []
    windows = np.lib.stride_tricks.sliding_window_view
    level = np.ptp(windows(T[:, 2, 3], _WINDOW), axis=-1) < _LEVEL
    level &= (
        np.linalg.norm(np.ptp(windows(T[:, 2, :3], _WINDOW, axis=0), axis=-1), axis=1) < _UPRIGHT
    )
    level &= windows(moving, _WINDOW).all(axis=-1)
    found = np.zeros(len(T), bool)
    for k in range(_WINDOW):
        found[np.flatnonzero(level) + k] = True
    return runs(found)
