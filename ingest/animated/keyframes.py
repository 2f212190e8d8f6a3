"""Keyframes of one object in CSV, and the motion between them.

Optional: a column `interpolation` (how the motion goes on from that key), and comment lines
`# fps: 24` (needed with `frame`), `# up: y` (else z) and `# interpolation: linear` (else smooth).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64, Int
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from ingest.animated.animation import (
    Animation,
    Up,
    check_times,
    checked,
    frame_times,
    numbers,
    rigid,
    stated,
    stated_fps,
    stated_up,
    unknown_word,
)
from ingest.formats.text_table import TextRows, first_row, read_rows
from omomo_core.errors import InputError

Mode = Literal["smooth", "linear", "constant"]
MODES: tuple[Mode, ...] = get_args(Mode)
_ROUNDING = 1e-5
"""Seconds by which a key may lie after a frame that shows it."""
_VANISHED = 1e-3
"""Norm of an interpolated quaternion below which it has no direction."""


@dataclass(frozen=True)
class Keyframes:
    """Poses at some times, and how they are interpolated."""

    source: Path
    times: Float64[np.ndarray, " keys"]
    """Seconds."""
    positions: Float64[np.ndarray, "keys 3"]
    xyzw: Float64[np.ndarray, "keys 4"]
    modes: tuple[Mode, ...]
    """How the motion goes on from each key."""
    up: Up
    places: tuple[str, ...]
    """Place of each key in the file, for messages."""


def animate(keys: Keyframes) -> Animation:
    """Return the motion between the keys at 30 fps.

    Raises:
        InputError: "animation-one-key", "time-backwards", "quaternion-not-unit",
            "quaternion-vanishes" or "animation-long".
    """
    place = keys.places.__getitem__
    check_times(keys.times, place, keys.source)
    values = np.concatenate([keys.positions, checked(keys.xyzw, place)], axis=1)
    at = frame_times(float(keys.times[0]), float(keys.times[-1]), keys.source)
    poses = interpolate(keys.times, values, keys.modes, at)
    _check_rotations(poses[:, 3:], at, keys.source)
    T = rigid(poses[:, :3], poses[:, 3:])
    return Animation(keys.source, T, np.ones(len(T), bool), keys.up)


def interpolate(
    times: Float64[np.ndarray, " keys"],
    values: Float64[np.ndarray, "keys columns"],
    modes: Sequence[Mode],
    at: Float64[np.ndarray, " samples"],
) -> Float64[np.ndarray, "samples columns"]:
    """Return each column at the wanted times; before the first and after the last key it is constant.

    A smooth curve is a monotone cubic (Fritsch and Carlson 1980, as scipy's PCHIP) that starts and
    ends flat: it turns only at keys and never leaves the range of the two keys beside it.

    Args:
        times: seconds of the keys, increasing, at least two.
        values: one row a key.
        modes: how the curve goes on from each key to the next.
        at: seconds at which the curve is wanted.
    """
    at = at.clip(times[0], times[-1])
    with np.errstate(over="ignore"):  # The slope beside a rise of next to nothing is zero.
        slopes = PchipInterpolator(times, values).derivative()(times)
    slopes[[0, -1]] = 0.0
    k = last_key(times, at)
    start = k.clip(0, len(times) - 2)
    u = ((at - times[start]) / np.diff(times)[start]).clip(0, 1)[:, None]
    curves = {
        "smooth": CubicHermiteSpline(times, values, slopes)(at),
        "linear": values[start] + u * (values[start + 1] - values[start]),
        "constant": values[k],
    }
    mode = np.array([MODES.index(m) for m in modes])[start][:, None]
    between = np.choose(mode, [curves[m] for m in MODES])
    return np.where((k == len(times) - 1)[:, None], values[-1], between)


def last_key(
    times: Float64[np.ndarray, " keys"], at: Float64[np.ndarray, " samples"]
) -> Int[np.ndarray, " samples"]:
    """Return the last key at or before each time (seconds), the first where there is none.

    A key that is only a rounding error away is reached: a step must not come a frame late.
    """
    return (np.searchsorted(times, at + _ROUNDING, side="right") - 1).clip(0)


def _check_rotations(
    xyzw: Float64[np.ndarray, "frames 4"], at: Float64[np.ndarray, " frames"], source: Path
) -> None:
    """Refuse quaternions that pass near zero between two keys."""
    gone = np.linalg.norm(xyzw, axis=1) < _VANISHED
    if gone.any():
        raise InputError(
            "quaternion-vanishes",
            f"Between two keys, at {at[np.argmax(gone)]:.2f} s, the quaternion shrinks to nothing.",
            where=str(source),
            fix="Put another key between them.",
        )


NAME = "CSV"
FILES = "keyframes as CSV with the columns time or frame, x, y, z, qx, qy, qz, qw"

_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def detect(path: Path) -> bool:
    """Whether the first line names x, y and z, and no `timestamp` (that is what phones write)."""
    names = _names(first_row(path).split(_separator(path)))
    return {"x", "y", "z"} <= set(names) and "timestamp" not in names


def read(path: Path) -> Animation:
    """Read keyframes and interpolate them at 30 fps.

    Raises:
        InputError: "csv-columns", "fps-missing", "comment-unknown", "interpolation-unknown",
            "row-damaged", "pose-not-finite"; besides those of `animate`.
    """
    text = read_rows(path, _separator(path))
    names, rows = _names(text.rows[0]), text.without_header()
    clock = "time" if "time" in names else "frame"
    missing = [name for name in (clock, *_POSE) if name not in names]
    if missing:
        raise InputError(
            "csv-columns",
            f"The header of {path.name} lacks {', '.join(missing)}; it has {', '.join(names)}.",
            where=f"{path}:{text.lines[0]}",
            fix="Name the columns time (or frame), x, y, z, qx, qy, qz, qw.",
        )
    doubled = [name for name in (clock, *_POSE, "interpolation") if names.count(name) > 1]
    if doubled:
        raise InputError(
            "csv-columns",
            f"The header of {path.name} names more than one column {', '.join(doubled)}.",
            where=f"{path}:{text.lines[0]}",
            fix="Name each column once.",
        )
    table = numbers(rows, len(names), [names.index(name) for name in (clock, *_POSE)])
    fps = 1.0 if clock == "time" else stated_fps(path)
    return animate(
        Keyframes(
            source=path,
            times=table.values[:, 0] / fps,
            positions=table.values[:, 1:4],
            xyzw=table.values[:, 4:],
            modes=_modes(rows, names),
            up=stated_up(path),
            places=tuple(table.place(row) for row in range(len(table.lines))),
        )
    )


def _names(fields: list[str] | tuple[str, ...]) -> list[str]:
    return [field.strip().strip("\"'").lower() for field in fields]


def _separator(path: Path) -> str:
    header = first_row(path)
    return max(",;\t", key=header.count)


def _modes(rows: TextRows, names: list[str]) -> tuple[Mode, ...]:
    usual = stated(rows.path).get("interpolation", "smooth")
    known: dict[str, Mode] = {mode: mode for mode in MODES}
    if usual not in known:
        raise unknown_word(rows.path, "interpolation", usual)
    if "interpolation" not in names:
        return (known[usual],) * len(rows.rows)
    column = names.index("interpolation")
    modes: list[Mode] = []
    for fields, line in zip(rows.rows, rows.lines, strict=True):
        word = fields[column].strip("\"'").lower() or usual
        if word not in known:
            raise InputError(
                "interpolation-unknown",
                f"{word[:30]!r} is no interpolation that is played.",
                where=f"{rows.path}:{line}",
                fix=f"Write one of {', '.join(MODES)}; bake other curves to keys in every frame.",
            )
        modes.append(known[word])
    return tuple(modes)
