"""Where markers were at each time, and where they sit on a scan."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from omomo_core.errors import InputError

_RATES = (10.0, 2000.0)
"""Frames a second between which motion is captured."""
_SPREAD = (0.02, 5.0)
"""Metres between the farthest two markers of a thing that a person moves."""
_FARTHEST = 100.0
"""Metres from the origin that no capture room has."""


@dataclass(frozen=True)
class Tracks:
    """Markers over time."""

    source: Path
    times: Float[np.ndarray, " frames"]
    """Seconds, strictly increasing."""
    names: tuple[str, ...]
    points: Float[np.ndarray, "frames markers 3"]
    """World, metres; NaN while a marker is not seen."""

    def of(self, places: "Places") -> "Tracks":
        """The markers that have places, in their order; recorders write ``subject:marker``.

        Raises:
            InputError: ``marker-missing``, ``marker-twice``.
        """
        columns: list[int] = []
        for wanted in places.names:
            found = [k for k, n in enumerate(self.names) if n == wanted]
            found = found or [k for k, n in enumerate(self.names) if n.endswith(f":{wanted}")]
            if len(found) != 1:
                some = ", ".join(self.names[:12])
                raise InputError(
                    "marker-twice" if found else "marker-missing",
                    f"{len(found)} tracks are of marker {wanted!r}; the tracks are of {some}.",
                    where=str(self.source),
                    fix=f"Name it in {places.source.name} as the recording does.",
                )
            columns += found
        return replace(self, names=places.names, points=self.points[:, columns])

    def between(self, start: float | None, end: float | None) -> "Tracks":
        """The frames from one time to another, seconds."""
        wanted = np.ones(len(self.times), bool)
        if start is not None:
            wanted &= self.times >= start
        if end is not None:
            wanted &= self.times <= end
        return check_times(replace(self, times=self.times[wanted], points=self.points[wanted]))


@dataclass(frozen=True)
class Places:
    """Where markers sit on a mesh."""

    source: Path
    names: tuple[str, ...]
    points: Float[np.ndarray, "markers 3"]
    """In the axes and the unit of the mesh's file."""


def check_times(tracks: Tracks) -> Tracks:
    """The same tracks, refused when they are no recording.

    Raises:
        InputError: ``markers-short``, ``markers-times``, ``markers-rate``.
    """
    where = str(tracks.source)
    if len(tracks.times) < 2:
        raise InputError("markers-short", "There are fewer than two frames.", where=where)
    steps = np.diff(tracks.times)
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        frame = int((~(steps > 0)).argmax()) + 1
        raise InputError(
            "markers-times", "Time does not go on.", where=f"{where}, frame {frame}",
            fix="Give frames in the order of their times, in seconds.",
        )  # fmt: skip
    rate = 1.0 / float(np.median(steps))
    if not _RATES[0] <= rate <= _RATES[1]:
        raise InputError(
            "markers-rate", f"{rate:.4g} frames a second cannot be right.", where=where,
            fix="Times are in seconds.",
        )  # fmt: skip
    return tracks


def check_seen(tracks: Tracks) -> None:
    """Refuse the markers of a thing that nobody moves: the unit is another; and those never seen.

    Raises:
        InputError: ``markers-unseen``, ``markers-units``.
    """
    seen = np.isfinite(tracks.points).all(axis=2)
    enough = seen.sum(axis=1) >= 3
    if not enough.any():
        raise InputError(
            "markers-unseen",
            f"In no frame are three of the markers {', '.join(tracks.names)} seen.",
            where=str(tracks.source),
            fix="Label the markers in more frames.",
        )
    points = tracks.points[enough]
    spread = np.nanmax(points, axis=1) - np.nanmin(points, axis=1)
    size = float(np.median(np.linalg.norm(spread, axis=-1)))
    if not _SPREAD[0] < size < _SPREAD[1] or np.nanmax(np.abs(points)) > _FARTHEST:
        raise InputError(
            "markers-units",
            f"The markers are {size:.3g} m apart.",
            where=str(tracks.source),
            fix="Say the unit of the tracks with --unit (m, cm or mm).",
        )
