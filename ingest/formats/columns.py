"""Find the columns of a pose table by the names in its header, or in the comment above its first row.

Known are the spellings of pandas (`timestamp,x,y,z,qx,qy,qz,qw`), evo (`tx`, `ty`), EuRoC and ETHZ
(`#timestamp [ns], p_RS_R_x [m], q_RS_w []`) and of ROS tables (`pose.position.x`).
"""

import re
from dataclasses import dataclass
from pathlib import Path

from ingest.formats.pick import floats, head_lines

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_SEPARATORS = (",", ";", "\t", None)
_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_CLOCK = re.compile(
    r"(?:.*_)?(?:timestamp|time|stamp|secs|seconds|t)(?:_(s|sec|seconds|ms|us|ns))?"
)
_TURN = re.compile(r"(?:.*_)?(?:q|quat|quaternion|orientation|rotation|rot)(?:_[a-z]+)*?_?([wxyz])")
_PLACE = re.compile(
    r"(?:(?:.*_)?(?:t|p|pos|position|translation|trans|loc|location)(?:_[a-z]+)*?_?)?([xyz])(?:_m)?"
)
_OTHER = re.compile(
    r"(?:^|_)(?:v|vel|velocity|acc?|accel|acceleration|gyro?|omega|twist|bias|b|cov|covariance|sigma|std)"
    r"(?:_|$)"
)


@dataclass(frozen=True)
class Columns:
    """Which column of a pose table holds what."""

    places: tuple[int, ...]
    """Columns of the time, x, y, z, qx, qy, qz and qw."""
    width: int
    """Columns in all."""
    second: float
    """Seconds in one unit of the time's column; 1 where its name does not say."""
    separator: str | None
    """Between fields; None is white space."""
    commented: bool
    """The header is a comment, and no row of the table."""
    names: frozenset[str] = frozenset()
    """All that the header names, in small letters."""


def named_columns(file: Path) -> Columns | None:
    """Return the columns that the header or a comment above the first row names, or None."""
    lines = [line.strip() for line in head_lines(file) if line.strip()]
    first = next((k for k, line in enumerate(lines) if not line.startswith("#")), len(lines))
    candidates = [(line.lstrip("#"), True) for line in reversed(lines[:first])]
    candidates += [(line, False) for line in lines[first : first + 1]]
    for line, commented in candidates:
        for separator in _SEPARATORS:
            if (found := _columns(line, separator, commented)) is not None:
                return found
    return None


def _columns(line: str, separator: str | None, commented: bool) -> Columns | None:
    fields = line.split(separator)
    if len(fields) < len(POSE) + 1 or floats(fields):
        return None
    roles = [_role(field) for field in fields]
    wanted = ("time", *POSE)
    if any(sum(role == name for role, _ in roles) != 1 for name in wanted):
        return None
    places = tuple(next(k for k, (role, _) in enumerate(roles) if role == name) for name in wanted)
    names = frozenset(field.strip().lower() for field in fields)
    return Columns(places, len(fields), roles[places[0]][1], separator, commented, names)


def _role(field: str) -> tuple[str, float]:
    """What a column holds, "" for anything else, and its unit if it is the time."""
    name = re.sub(r"[^a-z0-9]+", "_", field.lower()).strip("_")
    if _OTHER.search(name):
        return "", 1.0
    if match := _CLOCK.fullmatch(name):
        return "time", _UNITS[match[1] or "s"]
    if match := _TURN.fullmatch(name):
        return f"q{match[1]}", 1.0
    if match := _PLACE.fullmatch(name):
        return match[1], 1.0
    return "", 1.0
