"""Places, directions, boxes, times and sizes of pictures, as a user writes them."""

import math
import re
from collections.abc import Sequence
from typing import Any, get_args

from ingest.trajectory.trajectory_config import Top
from omomo_core.errors import InputError

INTRINSICS = "Write fx,fy,cx,cy in pixels of the photos, e.g. 3050,3050,2016,1512."
"""What to do where they are not understood."""

Place = tuple[float, float]
"""On the floor of a result's world, metres."""


def read_place(text: str | None, where: str, words: Sequence[str] = ("phone",)) -> Any:
    """The two numbers of "0.8,-1.2", or one of some words; None where nothing is said.

    Raises:
        InputError: "place-invalid": it is written otherwise.
    """
    if text is None or text in words:
        return text
    try:
        x, y = (float(part) for part in text.split(","))
        if math.isfinite(x + y):
            return x, y
    except ValueError:
        pass
    raise InputError(
        "place-invalid",
        f"{text!r} is no place.",
        where=where,
        fix="Write two numbers with a comma between them, e.g. 0.8,-1.2"
        + (f", or one of the words {', '.join(words)}." if words else "."),
    )


def read_up(text: str | None, where: str) -> tuple[float, float, float] | Top | None:
    """The three numbers of "0,1,0", or the axis of the mesh that "object:z" names.

    Raises:
        InputError: "direction-invalid": it is written otherwise.
    """
    if text is None:
        return None
    for axis in get_args(Top):
        if text.strip().lower() == axis:
            return axis
    try:
        x, y, z = (float(part) for part in text.split(","))
        if math.isfinite(x + y + z):
            return x, y, z
    except ValueError:
        pass
    raise InputError(
        "direction-invalid",
        f"{text!r} is no direction.",
        where=where,
        fix="Write three numbers with commas between them, e.g. 0,1,0, or an axis of the mesh, e.g. "
        "object:z.",
    )


def read_box(text: str, where: str) -> tuple[float, ...]:
    """The six numbers of "x,y,z,x,y,z": two corners of a box, metres.

    Raises:
        InputError: "scan-box": it is written otherwise.
    """
    try:
        corners = tuple(float(part) for part in text.split(","))
        if len(corners) == 6 and all(map(math.isfinite, corners)):
            return corners
    except ValueError:
        pass
    raise InputError(
        "scan-box",
        f"{text!r} is no box.",
        where=where,
        fix="Write its lowest and its highest corner in metres, z up, such as "
        "-0.3,-0.2,0,0.4,0.5,1.1; report.json of the scan says the box that was used.",
    )


def read_point(text: str, where: str) -> tuple[float, ...]:
    """The three numbers of "x,y,z", metres.

    Raises:
        InputError: "point-invalid": it is written otherwise.
    """
    try:
        place = tuple(float(part) for part in text.split(","))
        if len(place) == 3 and all(map(math.isfinite, place)):
            return place
    except ValueError:
        pass
    raise InputError(
        "point-invalid",
        f"{text!r} is no point.",
        where=where,
        fix="Write three numbers in metres with commas between them, z up, e.g. 0.4,1.2,0.5.",
    )


def read_size(text: str, where: str) -> tuple[int, int]:
    """Width and height of "960x540".

    Raises:
        InputError: it is written otherwise, or of a size nobody wants.
    """
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text.strip().lower())
    width, height = (int(match[1]), int(match[2])) if match else (0, 0)
    if not (64 <= width <= 7680 and 64 <= height <= 4320):
        raise InputError(
            "size-invalid",
            f"{text!r} is no picture size.",
            where=where,
            fix="Write width x height in pixels, e.g. 1280x720.",
        )
    return width, height


def read_sheet(text: str, where: str) -> tuple[int, int]:
    """Columns and rows of "4x3".

    Raises:
        InputError: it is written otherwise, or they are more than anybody can look at.
    """
    match = re.fullmatch(r"(\d{1,2})x(\d{1,2})", text.strip().lower())
    columns, rows = (int(match[1]), int(match[2])) if match else (0, 0)
    if not (1 <= columns <= 20 and 1 <= rows <= 20):
        raise InputError(
            "sheet-invalid",
            f"{text!r} is no sheet of pictures.",
            where=where,
            fix="Write columns x rows, 20 of each at most, e.g. 4x3.",
        )
    return columns, rows


def read_numbers(text: str, count: int, where: str) -> list[float]:
    """Return so many numbers with blanks or commas between them.

    Raises:
        InputError: "drawing-numbers".
    """
    from ingest.calibration.drawn_mount import numbers

    return numbers(text, count, where).tolist()


def read_intrinsics(text: str, where: str) -> tuple[float, ...]:
    """The focal lengths and the centre of "fx,fy,cx,cy", pixels.

    Raises:
        InputError: "intrinsics-unreadable".
    """
    try:
        fx, fy, cx, cy = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            "intrinsics-unreadable", f"{text!r} are no intrinsics.", where=where, fix=INTRINSICS
        ) from None
    return fx, fy, cx, cy


def read_span(text: str, where: str) -> tuple[float, float]:
    """The stretch of time of "12.5:14", seconds.

    Raises:
        InputError: "still-unreadable".
    """
    try:
        start, stop = (float(part) for part in text.split(":"))
        if not 0 <= start < stop:
            raise ValueError("the first comes before the second")
    except ValueError:
        raise InputError(
            "still-unreadable",
            f"{text!r} is no stretch of time.",
            where=where,
            fix="Write two numbers of seconds with a colon, e.g. 12.5:14.",
        ) from None
    return start, stop
