"""Tables of poses: columns by the names over them, stamps in seconds, positions in metres.

Known are the spellings of pandas (`timestamp,x,y,z,qx,qy,qz,qw`), evo (`tx`, `ty`), EuRoC and ETHZ
(`#timestamp [ns], p_RS_R_x [m], q_RS_w []`), of ROS tables (`pose.position.x`, `header.stamp.nanosec`)
and units behind a name (`tx_mm`, `time (ms)`).
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import Place
from ingest.formats.log_units import Clock, read_clock
from ingest.formats.text_table import (
    NumberTable,
    first_row,
    floats,
    head_lines,
    numbers,
    read_rows,
)
from omomo_core.errors import InputError

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_WANTED = ("time", *POSE)
_NAMED = 6
"""Columns of a pose's eight at least; a line that names fewer is no header, but prose or another table's."""
_SEPARATORS = (",", ";", "\t", None)

_SECONDS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "usec", "micros", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanosec", "nanosecond", "nanoseconds"), 1e-9),
}
_METRES = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 1.0),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), 1e-2),
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), 1e-3),
}
_CLOCK = re.compile(rf"(?:.*_)?(?:timestamp|time|stamp|secs|seconds|t)(?:_({'|'.join(_SECONDS)}))?")
_PART = re.compile(r"(.*stamp)_?(?:nsecs?|nanosecs?|nanoseconds?)")
"""The part of a second that ROS writes beside whole seconds."""
_TURN = re.compile(r"(?:.*_)?(?:q|quat|quaternion|orientation|rotation|rot)(?:_[a-z]+)*?_?([wxyz])")
_PLACE = re.compile(
    r"(?:(?:.*_)?(?:t|p|pos|position|translation|trans|loc|location)(?:_[a-z]+)*?_?)?([xyz])"
    rf"(?:_({'|'.join(_METRES)}))?"
)
_OTHER = re.compile(
    r"(?:^|_)(?:v|vel|velocity|acc?|accel|acceleration|gyro?|omega|twist|bias|b|cov|covariance|sigma|std)"
    r"(?:_|$)"
)


class _Role(NamedTuple):
    """What a column holds, "" for what is not needed, and its unit in seconds or metres where it is named."""

    name: str
    unit: float | None = None


@dataclass(frozen=True)
class ColumnHeader:
    """The line that names the columns of a table of poses."""

    path: Path
    line: int
    """Its number, from 1."""
    fields: tuple[str, ...]
    separator: str | None
    """Between its fields; None is white space."""
    commented: bool
    """It is a comment, and no row of the table."""

    @property
    def names(self) -> frozenset[str]:
        """All that it names, in small letters."""
        return frozenset(field.strip().lower() for field in self.fields)

    @property
    def roles(self) -> tuple[_Role, ...]:
        """What each column holds."""
        return tuple(_role(field) for field in self.fields)

    @property
    def in_order(self) -> bool:
        """Whether it names the eight numbers t x y z qx qy qz qw, and nothing else."""
        return tuple(role.name for role in self.roles) == _WANTED


def header_of(file: Path) -> ColumnHeader | None:
    """Return the header, or the comment above the first row, that names the columns of poses.

    Nothing is refused here: a line that names most of a pose's columns is a header, be it right or not.
    """
    lines = [(k, line.strip()) for k, line in enumerate(head_lines(file), 1) if line.strip()]
    first = next((k for k, (_, line) in enumerate(lines) if not line.startswith("#")), len(lines))
    candidates = [(k, line.lstrip("#%"), True) for k, line in reversed(lines[:first])]
    candidates += [(k, line.lstrip("%"), False) for k, line in lines[first : first + 1]]
    for number, line, commented in candidates:
        for separator in _SEPARATORS:
            fields = tuple(field.strip() for field in line.split(separator))
            if not floats(fields) and _names_poses(fields):
                return ColumnHeader(file, number, fields, separator, commented)
    return None


def is_in_order(file: Path) -> bool:
    """Whether rows are `t x y z qx qy qz qw` between blanks, and no header says that they are others.

    The last four must be about a unit quaternion, or the first row is no pose.
    """
    header = header_of(file)
    if header is not None and not header.in_order:
        return False
    row = floats((first_row(file) if header is None else _first_pose(file, header)).split())
    return len(row) == len(_WANTED) and bool(
        abs(np.linalg.norm(np.clip(row[4:], -9, 9)) - 1) <= 0.1
    )


def _names_poses(fields: Sequence[str]) -> bool:
    found = {_role(field).name for field in fields} & set(_WANTED)
    return len(found) >= _NAMED and any(name.startswith("q") for name in found)


def _role(field: str) -> _Role:
    name = re.sub(r"[^a-z0-9]+", "_", re.sub("[µμ]", "u", field.lower())).strip("_")
    if _OTHER.search(name):
        return _Role("")
    if match := _PART.fullmatch(name):
        return _Role("part")
    if match := _CLOCK.fullmatch(name):
        return _Role("time", _SECONDS[match[1]] if match[1] else None)
    if match := _TURN.fullmatch(name):
        return _Role(f"q{match[1]}")
    if match := _PLACE.fullmatch(name):
        return _Role(match[1], _METRES[match[2]] if match[2] else None)
    return _Role("")


@dataclass(frozen=True)
class Columns:
    """Which column of a table of poses holds what."""

    places: tuple[int, ...]
    """Columns of the time, x, y, z, qx, qy, qz and qw."""
    width: int
    """Columns in all."""
    separator: str | None
    """Between fields; None is white space."""
    second: float | None = None
    """Seconds in one unit of the time's column, where its name says it."""
    metre: float | None = None
    """Metres in one unit of the positions, where their names say it."""
    part: int | None = None
    """Column of the nanoseconds beside whole seconds."""


IN_ORDER = Columns(tuple(range(8)), 8, None)
"""Lines of `t x y z qx qy qz qw` between blanks."""


def columns_of(header: ColumnHeader) -> Columns:
    """The columns that a header names.

    Raises:
        InputError: "header-unclear" where it names a column twice, or one of a pose not at all, or
            positions in different units.
    """
    roles = header.roles
    count = Counter(role.name for role in roles)
    places: dict[str, int] = {}
    for k, role in enumerate(roles):
        # ROS writes when a message was kept, and in its header when it was true.
        of_message = role.name == "time" and "header" in header.fields[k].lower()
        if role.name not in places or (count["time"] == 2 and of_message):
            places[role.name] = k
    missing = [name for name in _WANTED if name not in places]
    doubled = [name for name in POSE if count[name] > 1]
    stamped = [header.fields[k] for k, role in enumerate(roles) if role.name == "time"]
    if len(stamped) > 1 and sum("header" in name.lower() for name in stamped) != 1:
        doubled.append("time")
    units = {roles[places[name]].unit for name in "xyz" if name in places}
    if missing or doubled or len(units) > 1:
        raise _unclear(header, missing, doubled)
    return Columns(
        tuple(places[name] for name in _WANTED),
        len(roles),
        header.separator,
        roles[places["time"]].unit if "part" not in places else 1.0,
        units.pop(),
        places.get("part"),
    )


def _unclear(header: ColumnHeader, missing: list[str], doubled: list[str]) -> InputError:
    if doubled:
        what = f"names more than one column for {', '.join(doubled)}"
        what += f" and none for {', '.join(missing)}" if missing else ""
    elif missing:
        what = f"names no column for {', '.join(missing)}"
    else:
        what = "names positions in different units"
    return InputError(
        "header-unclear",
        f"The header of {header.path.name} {what}.",
        where=f"{header.path}:{header.line}",
        fix="Name each of the columns time, x, y, z, qx, qy, qz and qw once.",
    )


@dataclass(frozen=True)
class PoseRows:
    """The poses of a table as it states them."""

    clock: Clock
    """Stamps in seconds."""
    positions: Float64[np.ndarray, "rows 3"]
    """Metres."""
    xyzw: Float64[np.ndarray, "rows 4"]
    table: NumberTable
    """Its numbers, and the line of each row."""

    @property
    def place(self) -> Place:
        """File and line of a row, for messages."""
        return self.table.place


def read_pose_rows(log: Path, usual: Columns) -> PoseRows:
    """The rows of a table of poses.

    Args:
        log: of the table.
        usual: its columns where no header names them.

    Raises:
        InputError: "header-unclear", "header-width", "units-unclear", and those of
            `ingest.formats.text_table.numbers`.
    """
    header = header_of(log)
    columns = usual if header is None else _fitting(log, columns_of(header), header)
    text = read_rows(log, columns.separator)
    rows = text if header is None or header.commented else text.without_header()
    wanted = columns.places if columns.part is None else (*columns.places, columns.part)
    table = numbers(rows, columns.width, wanted)
    stamps = table.values[:, 0] + (0 if columns.part is None else 1e-9 * table.values[:, 8])
    return PoseRows(
        read_clock(stamps, columns.second, table.place),
        table.values[:, 1:4] * (columns.metre or 1.0),
        table.values[:, 4:8],
        table,
    )


def _fitting(log: Path, columns: Columns, header: ColumnHeader) -> Columns:
    """The columns with the separator of the rows, which need not be that of the header."""
    row = _first_pose(log, header)
    split = {s: row.split(s) for s in (columns.separator, *_SEPARATORS)}
    fitting = [s for s, fields in split.items() if len(fields) == columns.width]
    # A table may hold words besides, but not where the pose is; a comma behind a number is no number.
    good = [s for s in fitting if floats([split[s][k] for k in columns.places])]
    if good or fitting:
        return replace(columns, separator=(good or fitting)[0])
    if not any(floats(fields) for fields in split.values()):
        return columns  # a damaged first row is told as one
    raise InputError(
        "header-width",
        f"The header of {log.name} names {columns.width} columns, and the first row has "
        f"{len(split[columns.separator])}.",
        where=f"{log}:{header.line}",
        fix="Give a header with a name for each column.",
    )


def _first_pose(log: Path, header: ColumnHeader) -> str:
    if header.commented:
        return first_row(log)
    rows = [line.strip() for line in head_lines(log)[header.line :]]
    return next((row for row in rows if row and not row.startswith("#")), "")
