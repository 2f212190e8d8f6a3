"""Marker tracks and the markers' places on a scan, and the reading of their files.

Tracks are npz (``points`` (T, M, 3), ``names`` (M,), and ``times`` (T,) or ``fps``), CSV with the columns
``time`` and ``<name>_x``, ``<name>_y``, ``<name>_z``, or the CSV that Vicon Nexus exports (a line
``Trajectories``, the rate, the names, ``Frame,Sub Frame,X,Y,Z,...``, the units). Where a marker is not
seen, the fields are empty or NaN. Places are CSV with the columns name, x, y, z.
"""

import csv
import io
import zipfile
import zlib
from collections.abc import Sequence
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
    """The places of markers on a mesh."""

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


MOST_BYTES = 1 << 29
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_UNREADABLE = (OSError, ValueError, EOFError, KeyError, TypeError, zipfile.BadZipFile, zlib.error)
_VICON = "trajectories"
_FEWEST = 3

_Points = Float[np.ndarray, "frames markers 3"]


def read_tracks(path: Path, unit: str | None = None) -> Tracks:
    """Marker tracks in metres.

    Args:
        path: npz or CSV.
        unit: "m", "cm" or "mm"; what the file says if not given, else metres.

    Raises:
        InputError: ``unknown-unit``, ``markers-file``, and as `check_times`.
    """
    if unit is not None and unit not in UNITS:
        known = ", ".join(UNITS)
        raise InputError("unknown-unit", f"There is no unit {unit!r}.", fix=f"Use {known}.")
    tracks, own = _npz(path) if path.suffix.lower() == ".npz" else _csv(path)
    points = np.where(np.isfinite(tracks.points), tracks.points, np.nan)
    metres = UNITS[unit or own]
    return check_times(Tracks(path, tracks.times, tracks.names, points * metres))


def read_places(path: Path) -> Places:
    """The places of markers on a mesh.

    Raises:
        InputError: ``markers-file``, ``marker-twice``, ``markers-few``.
    """
    rows = _rows(path)
    if [word.lower() for word in rows[0][:4]] != ["name", "x", "y", "z"]:
        raise _bad(path, 1, "the header is not name,x,y,z")
    names: list[str] = []
    places: list[list[float]] = []
    for line, row in _filled(rows):
        place = _numbers(row[1:4], path, line)
        if len(place) < 3 or not np.isfinite(place).all():
            raise _bad(path, line, "a coordinate is missing")
        names.append(row[0])
        places.append(place)
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        where = str(path)
        raise InputError("marker-twice", f"{min(twice)!r} has two places.", where=where)
    if len(names) < _FEWEST:
        raise InputError(
            "markers-few", f"{len(names)} markers do not fix a pose.", where=str(path),
            fix="Give the places of three or more; the paper has five, and a lost one does no harm.",
        )  # fmt: skip
    return Places(path, tuple(names), np.array(places))


def _npz(path: Path) -> tuple[Tracks, str]:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ValueError("it is larger than any recording")
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            points = np.asarray(data["points"], np.float64)
            names = tuple(str(name) for name in data["names"].tolist())
            frames = np.arange(len(points))
            times = data["times"] if "times" in data else frames / float(data["fps"])
            unit = str(data["unit"]) if "unit" in data else "m"
        times = np.asarray(times, np.float64)
        if points.shape != (*times.shape, len(names), 3) or unit not in UNITS:
            raise ValueError(f"points are of shape {points.shape}, unit {unit!r}")
    except _UNREADABLE as problem:
        raise InputError(
            "markers-file",
            f"The tracks cannot be read: {problem}.",
            where=str(path),
            fix="Save points (T, M, 3), names (M,), and times (T,) or fps.",
        ) from problem
    return Tracks(path, times, names, points), unit


def _csv(path: Path) -> tuple[Tracks, str]:
    rows = _rows(path)
    first = next((k for k, row in enumerate(rows) if row[0].lower() == _VICON), None)
    return (_plain(path, rows), "m") if first is None else _vicon(path, rows, first)


def _plain(path: Path, rows: list[list[str]]) -> Tracks:
    header = [word.lower() for word in rows[0]]
    names = [word[:-2] for word in rows[0] if word[-2:].lower() == "_x"]
    columns = [f"{name}_{axis}".lower() for name in names for axis in "xyz"]
    missing = [word for word in ("time", *columns) if word not in header]
    if missing or not names:
        raise _bad(path, 1, f"there is no column {missing[0] if missing else '<name>_x'}")
    at = [header.index(word) for word in ("time", *columns)]
    filled, wide = _filled(rows), max(at)
    values = np.empty((len(filled), len(at)))
    for k, (line, row) in enumerate(filled):
        if len(row) <= wide:
            raise _bad(path, line, "it has fewer fields than the header")
        values[k] = _numbers([row[c] for c in at], path, line)
    return Tracks(path, values[:, 0], tuple(names), _in_threes(values[:, 1:]))


def _vicon(path: Path, rows: list[list[str]], first: int) -> tuple[Tracks, str]:
    if len(rows) < first + 6:
        raise _bad(path, len(rows), "it ends in the header")
    (rate,) = _numbers(rows[first + 1][:1], path, first + 2)
    names = [word for word in rows[first + 2] if word]
    unit = next((word for word in rows[first + 4] if word), "mm")
    if not rate > 0 or unit not in UNITS:
        raise _bad(path, first + 2, f"the rate is {rate:g}, the unit {unit!r}")
    wide = 2 + 3 * len(names)
    # The section ends at an empty line, where that of another kind of data may follow.
    last = next((k for k in range(first + 5, len(rows)) if not any(rows[k])), len(rows))
    values = np.empty((last - first - 5, wide))
    for k in range(len(values)):
        row, line = rows[first + 5 + k], first + 6 + k
        if len(row) > wide and any(row[wide:]):
            raise _bad(path, line, "it has more fields than there are names")
        values[k] = _numbers((row + [""] * wide)[:wide], path, line)
    return Tracks(path, values[:, 0] / rate, tuple(names), _in_threes(values[:, 2:])), unit


def _in_threes(values: Float[np.ndarray, "frames numbers"]) -> _Points:
    return values.reshape(len(values), -1, 3)


def _rows(path: Path) -> list[list[str]]:
    """The fields of every line, blanks taken off."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ValueError("it is larger than any recording")
        text = path.read_text("utf-8-sig", errors="strict")
        rows = [[word.strip() for word in row] or [""] for row in csv.reader(io.StringIO(text))]
    except (OSError, ValueError, csv.Error) as problem:
        raise InputError(
            "markers-file", f"The file cannot be read: {problem}.", where=str(path),
            fix="Give a CSV file, or npz.",
        ) from problem  # fmt: skip
    if len(rows) < 2:
        raise _bad(path, 1, "it is empty")
    return rows


def _filled(rows: list[list[str]]) -> list[tuple[int, list[str]]]:
    """Rows after the header that are not empty, with their lines."""
    return [(line, row) for line, row in enumerate(rows[1:], 2) if any(row)]


def _numbers(words: Sequence[str], path: Path, line: int) -> list[float]:
    """Numbers, NaN for what is empty."""
    try:
        return [float(word) if word else np.nan for word in words]
    except ValueError as problem:
        raise _bad(path, line, "there is text where a number belongs") from problem


def _bad(path: Path, line: int, why: str) -> InputError:
    return InputError(
        "markers-file",
        f"The file is not as it should be: {why}.",
        where=f"{path}:{line}",
        fix="See docs/data.md for the kinds of files that are read.",
    )
