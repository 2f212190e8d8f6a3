"""The animation of an object, and what its readers share: rows, quaternions, comments, checks."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.formats.text_table import NumberTable, TextRows, floats, head_lines
from ingest.trajectory.smooth import resample
from omomo_core.errors import InputError
from omomo_core.motion import FPS, ObjectMesh

Up = Literal["y", "z"]

MAX_SECONDS, MAX_FPS = 3600.0, 10_000.0
_SAME_TIME = 1e-3
"""Part of a frame; files keep times in single precision."""


@dataclass(frozen=True)
class Animation:
    """Rigid poses of one object in the axes and the world of its file, metres."""

    source: Path
    T_file_object: Float64[np.ndarray, "frames 4 4"]
    """Maps the mesh's coordinates, as its own file has them, into the file's world."""
    valid: Bool[np.ndarray, " frames"]
    """False in the gaps of a recorded motion."""
    up: Up
    """Which axis of the file's world points up."""
    mesh: ObjectMesh | None = None
    """The object's surface, where the file holds one."""
    notes: tuple[str, ...] = ()
    """What of the file's object is not rigid, and how it was read."""


def not_rigid(bending: Sequence[str], apart: Sequence[str]) -> tuple[str, ...]:
    """Sentences about nodes of an object whose shape changes, and about those that move by themselves."""
    notes = list[str]()
    if bending:
        notes.append(
            f"The shape of {', '.join(bending)} changes in the file; the object that a person moves is "
            "one rigid thing, so its shape at rest was taken."
        )
    if apart:
        notes.append(
            "What moves by itself on the object, or is bent by bones, is no part of it and was left "
            f"out: {', '.join(apart)}."
        )
    return tuple(notes)


def frame_times(first: float, last: float, source: Path) -> Float64[np.ndarray, " frames"]:
    """Every 1/30 s from the first to the last time (seconds).

    Raises:
        InputError: "animation-long" for more than an hour: the times are in another unit.
    """
    if last - first > MAX_SECONDS:
        raise InputError(
            "animation-long",
            f"The animation lasts {last - first:,.0f} s; at most {MAX_SECONDS:,.0f} s are read.",
            where=str(source),
            fix="Give times in seconds (not milliseconds), and the scene's frame rate.",
        )
    count = int((last - first) * FPS + _SAME_TIME) + 1
    return np.minimum(first + np.arange(count) / FPS, last)


def rigid(
    positions: Float64[np.ndarray, "keys 3"], xyzw: Float64[np.ndarray, "keys 4"]
) -> Float64[np.ndarray, "keys 4 4"]:
    """Transforms of positions and quaternions (any length but 0)."""
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, :3, :3] = Rotation.from_quat(xyzw).as_matrix()
    T[:, :3, 3] = positions
    return T


def check_times(
    times: Float64[np.ndarray, " keys"], place: Callable[[int], str], source: Path
) -> None:
    """Refuse fewer than two keys, and times (seconds) that do not advance.

    Raises:
        InputError: "animation-one-key", or "time-backwards" naming the key.
    """
    if len(times) < 2:
        raise InputError(
            "animation-one-key",
            f"{source.name} has {len(times)} pose{'' if len(times) == 1 else 's'}: nothing moves.",
            where=str(source),
            fix="Give at least two, a second or more apart.",
        )
    stops = np.diff(times) <= 0
    if stops.any():
        key = int(np.argmax(stops))
        raise InputError(
            "time-backwards",
            f"Time does not advance: it goes from {times[key]:.6g} s to {times[key + 1]:.6g} s.",
            where=place(key + 1),
            fix="Give the keys in the order of their times, one for each time.",
        )


_TOLERANCE = 0.02
"""Typed by hand with two decimals they are off by about this."""


def checked(
    xyzw: Float64[np.ndarray, "keys 4"], place: Callable[[int], str]
) -> Float64[np.ndarray, "keys 4"]:
    """The same rotations with length exactly 1, never jumping between q and -q.

    Args:
        xyzw: one quaternion per key.
        place: says where in the file a key is.

    Raises:
        InputError: "quaternion-not-unit" when a length is off by more than 2 %.
    """
    lengths = np.linalg.norm(xyzw, axis=1)
    off = ~(np.abs(lengths - 1) <= _TOLERANCE)
    if off.any():
        key = int(np.argmax(off))
        raise InputError(
            "quaternion-not-unit",
            f"The quaternion has length {lengths[key]:.4g} instead of 1.",
            where=place(key),
            fix="Give rotations as unit quaternions in the order x, y, z, w; 0, 0, 0, 1 is none.",
        )
    return xyzw / lengths[:, None] * signs(xyzw)[:, None]


def signs(xyzw: Float64[np.ndarray, "keys 4"]) -> Float64[np.ndarray, " keys"]:
    """1 or -1 for each, so that neighbours are less than half a turn of the 4-sphere apart."""
    flips = np.where((xyzw[1:] * xyzw[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return np.concatenate([[1.0], np.cumprod(flips)])


def numbers(rows: TextRows, width: int, columns: Sequence[int]) -> NumberTable:
    """The named columns of all rows, each of `width` fields.

    Raises:
        InputError: "row-damaged" or "pose-not-finite", naming the line.
    """
    values = np.empty((len(rows.rows), len(columns)))
    for i, (fields, line) in enumerate(zip(rows.rows, rows.lines, strict=True)):
        row = floats([fields[c] for c in columns]) if len(fields) == width else []
        if not row:
            raise InputError(
                "row-damaged",
                f"Line {line} of {rows.path.name} is no row of {width} fields with numbers where "
                f"they belong: {' '.join(fields)[:60]!r}.",
                where=f"{rows.path}:{line}",
                fix="Export the motion again, or mend the line.",
            )
        if not np.isfinite(row).all():
            raise not_finite(f"{rows.path}:{line}")
        values[i] = row
    return NumberTable(rows.path, values, rows.lines)


def not_finite(where: str) -> InputError:
    """The error for a pose with NaN or infinity."""
    return InputError(
        "pose-not-finite",
        "The pose has NaN or infinity where a number belongs.",
        where=where,
        fix="Export the motion again, or take this pose out.",
    )


_STATED = re.compile(r"\s*#\s*(\w+)\s*:\s*(\S+)\s*$")
_KNOWN = {
    "up": "y or z",
    "fps": "a number of frames a second",
    "interpolation": "smooth, linear or constant",
}


def stated(path: Path) -> dict[str, str]:
    """The words that comments give for up, fps and interpolation, in small letters."""
    found = [match for line in head_lines(path) if (match := _STATED.match(line))]
    return {m[1].lower(): m[2].lower() for m in found if m[1].lower() in _KNOWN}


def unknown_word(path: Path, key: str, value: str) -> InputError:
    """The error when a comment states an unknown word."""
    return InputError(
        "comment-unknown",
        f"The comment says that {key} is {value[:30]!r}; it can be {_KNOWN[key]}.",
        where=str(path),
        fix=f"Mend the line that begins with # {key}:.",
    )


def stated_up(path: Path) -> Up:
    """Which axis is up; z where no comment says so."""
    word = stated(path).get("up", "z")
    if word == "y":
        return "y"
    if word == "z":
        return "z"
    raise unknown_word(path, "up", word)


def stated_fps(path: Path) -> float:
    """Frames a second, for files that count frames.

    Raises:
        InputError: "fps-missing" or "comment-unknown".
    """
    word = stated(path).get("fps")
    if word is None:
        raise InputError(
            "fps-missing",
            f"{path.name} counts frames, and does not say how many are a second.",
            where=str(path),
            fix="Put a line like # fps: 24 at the top, or give a column time in seconds.",
        )
    rate = floats([word])
    if not rate or not 0 < rate[0] < MAX_FPS:
        raise unknown_word(path, "fps", word)
    return rate[0]


def sampled(
    source: Path,
    times: Float64[np.ndarray, " poses"],
    T: Float64[np.ndarray, "poses 4 4"],
    up: Up,
    gaps: Bool[np.ndarray, " steps"] | None = None,
) -> Animation:
    """Poses at 30 fps by timestamp: linear position, spherical rotation.

    Args:
        source: the file.
        times: seconds, strictly increasing, at least two.
        T: rigid poses in the file's world, metres.
        up: the world's axis that points up.
        gaps: marks the steps between poses that must not be bridged.
    """
    frame_times(float(times[0]), float(times[-1]), source)
    broken = np.zeros(len(times) - 1, bool) if gaps is None else gaps
    frames, valid = resample(times, T, broken)
    return Animation(source, frames, valid, up)
