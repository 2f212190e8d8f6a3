"""Tables of logs: columns by the names over them, stamps in seconds, positions in metres.

Known are the spellings of pandas (`timestamp,x,y,z,qx,qy,qz,qw`), evo (`tx`, `ty`), EuRoC and ETHZ
(`#timestamp [ns], p_RS_R_x [m], q_RS_w []`), of ROS tables (`pose.position.x`, `header.stamp.nanosec`)
and units behind a name (`tx_mm`, `time (ms)`).
"""

import re
from collections import Counter
from collections.abc import Mapping
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
    split_row,
)
from ingest.session import GRAVITY
from omomo_core.errors import InputError

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_WANTED = ("time", *POSE)
_SEPARATORS = (",", ";", "\t", None)
_MOST_FIELDS = 256
"""Columns of the widest tables, odometry of ROS with its covariances, are about 90."""

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
_SENSED = {
    "g": GRAVITY,
    **dict.fromkeys(("m_s_2", "m_s2", "mps2", "ms2", "rad_s", "rad_s_1", "rads"), 1.0),
    **dict.fromkeys(("deg_s", "deg_s_1", "dps"), float(np.pi / 180)),
}
_UNITS = {**_SECONDS, **_METRES, **_SENSED}

_CLOCK = rf"(?:.*_)?(?:timestamp|time|stamp|secs|seconds|t)(?:_({'|'.join(_SECONDS)}))?"
_PART = r".*stamp_?(?:nsecs?|nanosecs?|nanoseconds?)"
"""The part of a second that ROS writes beside whole seconds."""
_TURN = r"(?:.*_)?(?:q|quat|quaternion|orientation|rotation|rot)(?:_[a-z]+)*?_?"
_POSITION = r"(?:(?:.*_)?(?:t|p|pos|position|translation|trans|loc|location)(?:_[a-z]+)*?_?)?"
_PLACES = {axis: rf"{_POSITION}{axis}(?:_({'|'.join(_METRES)}))?" for axis in "xyz"}
_SENSE = r"(?:.*_)?(?:a|acc|accel\w*?|g|gyro\w*?|w|omega|rot\w*?|rate)?_?"
_OTHER = (
    r"(?:.*_)?(?:v|vel|velocity|acc?|accel|acceleration|gyro?|omega|twist|bias|b|cov|covariance|sigma|std)"
    r"(?:_.*)?"
)
_CELLS = tuple(f"{row}{column}" for row in "123" for column in "123")


@dataclass(frozen=True)
class ColumnNames:
    """What the columns of a kind of table hold, and what they are called."""

    wanted: tuple[str, ...]
    """What is read, in the order in which it is given back."""
    spellings: Mapping[str, str]
    """A pattern of the names of each, whose first group is a unit; "" is of what is not needed."""
    fewest: int
    """Columns of these at least; a line that names fewer is no header, but prose or another table's."""

    def role(self, field: str) -> "_Role":
        """What a column of this name holds."""
        name = re.sub(r"[^a-z0-9]+", "_", re.sub("[µμ]", "u", field.lower())).strip("_")
        for role, spelling in self.spellings.items():
            if match := re.fullmatch(spelling, name):
                unit = match[1] if match.lastindex else None
                return _Role(role, _UNITS[unit] if unit else None)
        return _Role("")


POSES = ColumnNames(
    _WANTED,
    {
        "": _OTHER,
        "part": _PART,
        "time": _CLOCK,
        **{f"q{axis}": _TURN + axis for axis in "wxyz"},
        **_PLACES,
    },
    fewest=6,
)
"""A position and a quaternion at a time."""
MATRICES = ColumnNames(
    ("time", *(f"r{cell}" for cell in _CELLS), "x", "y", "z"),
    {
        "time": _CLOCK,
        **{f"r{cell}": rf"(?:r|rot|rotation|m)_?{cell[0]}_?{cell[1]}" for cell in _CELLS},
        **_PLACES,
    },
    fewest=8,
)
"""A rotation matrix and a position at a time."""
ROTATION_VECTORS = ColumnNames(
    ("time", "rx", "ry", "rz", "x", "y", "z"),
    {
        "time": _CLOCK,
        **{f"r{axis}": rf"(?:r|rot|rotation|rotvec|axis_angle|angle|w)_?{axis}" for axis in "xyz"},
        **_PLACES,
    },
    fewest=5,
)
"""Axis times angle and a position at a time."""
_PINHOLE = {f"{kind}{axis}": rf"{kind}_?{axis}" for kind in "fc" for axis in "xy"}
INTRINSICS = ColumnNames(("time", "fx", "fy", "cx", "cy"), {"time": _CLOCK, **_PINHOLE}, fewest=4)
"""A camera's numbers at a time."""
SIZED_INTRINSICS = ColumnNames(
    ("w", "h", "fx", "fy", "cx", "cy"), {"w": "w|width", "h": "h|height", **_PINHOLE}, fewest=5
)
"""A camera's numbers and the size of its image."""
SENSOR = ColumnNames(
    ("time", "x", "y", "z"),
    {
        "time": _CLOCK,
        **{axis: rf"{_SENSE}{axis}(?:_({'|'.join(_SENSED)}))?" for axis in "xyz"},
    },
    fewest=3,
)
"""What an accelerometer or a gyroscope reads at a time."""


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
    columns: ColumnNames = POSES
    """What it is looked at for."""

    @property
    def names(self) -> frozenset[str]:
        """All that it names, in small letters."""
        return frozenset(field.strip().lower() for field in self.fields)

    @property
    def roles(self) -> tuple[_Role, ...]:
        """What each column holds."""
        return tuple(self.columns.role(field) for field in self.fields)

    @property
    def in_order(self) -> bool:
        """Whether it names the eight numbers t x y z qx qy qz qw, and nothing else."""
        return tuple(role.name for role in self.roles) == _WANTED


def header_of(file: Path, columns: ColumnNames = POSES) -> ColumnHeader | None:
    """Return the header, or the comment above the first row, that names such columns.

    Nothing is refused here: a line that names most of these columns is a header, be it right or not.
    """
    lines = [(k, line.strip()) for k, line in enumerate(head_lines(file), 1) if line.strip()]
    first = next((k for k, (_, line) in enumerate(lines) if not line.startswith("#")), len(lines))
    candidates = [(k, line.lstrip("%"), False) for k, line in lines[first : first + 1]]
    candidates += [(k, line.lstrip("#%"), True) for k, line in reversed(lines[:first])]
    for number, line, commented in candidates:
        for separator in _SEPARATORS:
            fields = tuple(field.strip() for field in line.split(separator))
            if not columns.fewest <= len(fields) <= _MOST_FIELDS:
                continue
            found = {columns.role(field).name for field in fields} & set(columns.wanted)
            if not floats(fields) and len(found) >= columns.fewest:
                return ColumnHeader(file, number, fields, separator, commented, columns)
    return None


def is_in_order(file: Path) -> bool:
    """Whether rows are `t x y z qx qy qz qw` between blanks, and no header says that they are others.

    The last four must be about a unit quaternion, or the first row is no pose.
    """
    header = header_of(file)
    if header is not None and not header.in_order:
        return False
    row = floats(first_pose(file, header).split())
    return len(row) == len(_WANTED) and bool(
        abs(np.linalg.norm(np.clip(row[4:], -9, 9)) - 1) <= 0.1
    )


@dataclass(frozen=True)
class Columns:
    """Which column of a table holds what."""

    places: tuple[int, ...]
    """Columns of what is wanted, in the order of `ColumnNames.wanted`."""
    width: int
    """Columns in all."""
    separator: str | None
    """Between fields; None is white space."""
    second: float | None = None
    """Seconds in one unit of the time's column, where its name says it."""
    scale: float | None = None
    """Metres (of sensors m/s^2 or rad/s) in one unit of x, y and z, where their names say it."""
    part: int | None = None
    """Column of the nanoseconds beside whole seconds."""


IN_ORDER = Columns(tuple(range(8)), 8, None)
"""Lines of `t x y z qx qy qz qw` between blanks."""


def columns_of(header: ColumnHeader) -> Columns:
    """The columns that a header names.

    Raises:
        InputError: "header-unclear" where it names a column twice, or a wanted one not at all, or
            x, y and z in different units.
    """
    roles, wanted = header.roles, header.columns.wanted
    count = Counter(role.name for role in roles)
    places: dict[str, int] = {}
    for k, role in enumerate(roles):
        # ROS writes when a message was kept, and in its header when it was true.
        of_message = role.name == "time" and "header" in header.fields[k].lower()
        if role.name not in places or (count["time"] == 2 and of_message):
            places[role.name] = k
    missing = [name for name in wanted if name not in places]
    doubled = [name for name in wanted if name != "time" and count[name] > 1]
    stamped = [header.fields[k] for k, role in enumerate(roles) if role.name == "time"]
    if len(stamped) > 1 and sum("header" in name.lower() for name in stamped) != 1:
        doubled.append("time")
    units = {roles[places[name]].unit for name in "xyz" if name in places}
    if missing or doubled or len(units) > 1:
        raise _unclear(header, missing, doubled)
    timed = "time" in places and "part" not in places
    return Columns(
        tuple(places[name] for name in wanted),
        len(roles),
        header.separator,
        roles[places["time"]].unit if timed else 1.0,
        next(iter(units), None),
        places.get("part"),
    )


def _unclear(header: ColumnHeader, missing: list[str], doubled: list[str]) -> InputError:
    if doubled:
        what = f"names more than one column for {', '.join(doubled)}"
        what += f" and none for {', '.join(missing)}" if missing else ""
    elif missing:
        what = f"names no column for {', '.join(missing)}"
    else:
        what = "names x, y and z in different units"
    *most, last = header.columns.wanted
    return InputError(
        "header-unclear",
        f"The header of {header.path.name} {what}.",
        where=f"{header.path}:{header.line}",
        fix=f"Name each of the columns {', '.join(most)} and {last} once.",
    )


@dataclass(frozen=True)
class NamedRows:
    """Rows of a table as it states them."""

    table: NumberTable
    """What is wanted, in the order of `ColumnNames.wanted`; x, y and z in metres, or in a sensor's unit."""
    seconds: float | None
    """Seconds in one unit of the stamps, where it is known."""

    @property
    def clock(self) -> Clock:
        """Stamps in seconds.

        Raises:
            InputError: "units-unclear".
        """
        return read_clock(self.table.values[:, 0], self.seconds, self.table.place)


def read_columns(log: Path, names: ColumnNames, usual: Columns) -> NamedRows:
    """The rows of a table by the names over its columns, or, where it has none, by their usual order.

    Args:
        log: of the table.
        names: what is read of it.
        usual: its columns, and their units, where no header names them.

    Raises:
        InputError: "header-unclear", "header-width", and those of `ingest.formats.text_table.numbers`.
    """
    header = header_of(log, names)
    columns = usual if header is None else _fitting(log, columns_of(header), header)
    text = read_rows(log, columns.separator)
    rows = text if header is None or header.commented else text.without_header()
    wanted = columns.places if columns.part is None else (*columns.places, columns.part)
    table = numbers(rows, columns.width, wanted)
    values = table.values[:, : len(names.wanted)].copy()
    if columns.part is not None:
        values[:, 0] += 1e-9 * table.values[:, -1]
    scaled = [k for k, name in enumerate(names.wanted) if name in "xyz"]
    # A header of another unit than the usual one says so; one without units leaves the usual ones.
    with np.errstate(over="ignore"):  # absurd readings are refused later
        values[:, scaled] *= columns.scale or usual.scale or 1.0
    seconds = usual.second if columns.second is None else columns.second
    return NamedRows(replace(table, values=values), seconds)


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

    Raises:
        InputError: "units-unclear", and those of `read_columns`.
    """
    rows = read_columns(log, POSES, _as_said(log, usual))
    values = rows.table.values
    return PoseRows(rows.clock, values[:, 1:4], values[:, 4:8], rows.table)


_ORDER = re.compile(
    r"(?<![a-z])(?:(q?_?w)[\s,;]*)?q?_?x[\s,;]*q?_?y[\s,;]*q?_?z(?:[\s,;]*(q?_?w))?(?![a-z])", re.I
)
"""Prose such as `quaternion (w, x, y, z)`; positions have no w."""


def _as_said(log: Path, usual: Columns) -> Columns:
    """The usual columns, with the quaternion in the order that comments above the first row say."""
    lines = [line.strip() for line in head_lines(log)]
    first = next((k for k, x in enumerate(lines) if x and not x.startswith("#")), len(lines))
    found = [match for line in lines[:first] for match in _ORDER.finditer(line)]
    ends = {(match[1] is not None, match[2] is not None) for match in found}
    quaternion = sorted(usual.places[4:])
    if (True, False) in ends and (False, True) not in ends:
        quaternion = [*quaternion[1:], quaternion[0]]
    elif (False, True) not in ends or (True, False) in ends:
        return usual
    return replace(usual, places=(*usual.places[:4], *quaternion))


def _fitting(log: Path, columns: Columns, header: ColumnHeader) -> Columns:
    """The columns with the separator of the rows, which need not be that of the header."""
    row = first_pose(log, header)
    split = {s: split_row(row, s) for s in (columns.separator, *_SEPARATORS)}
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


def first_pose(log: Path, header: ColumnHeader | None) -> str:
    """The first line of a table below its header, "" where there is none."""
    if header is None or header.commented:
        return first_row(log)
    rows = [line.strip() for line in head_lines(log)[header.line :]]
    return next((row for row in rows if row and not row.startswith("#")), "")
