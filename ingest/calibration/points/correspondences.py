"""Pairs of a point on the phone and the same point in the object's frame: typed, or from a file.

A point on the phone is a name (`ingest.calibration.phone.body.body_point`) or three numbers in metres in the
axes of the phone's camera (as ARKit's: phone held sideways with the charging port to the right, x
right, y up, z to you). A point on the object is three numbers in metres in the frame of its mesh.

Typed: `lens = 0.10 0.22 0.05`, `0.01 -0.02 0 = 0.1 0.2 0.05`.

CSV, with or without the heading: `phone,x,y,z` and, if wanted, `sigma_mm`:

    phone,x,y,z,sigma_mm
    top left back corner,0.102,0.220,0.051,2
    0.01 -0.02 0.0,0.100,0.200,0.050,2

JSON: `{"pairs": [{"phone": "lens", "object": [0.1, 0.22, 0.05], "sigma_mm": 2}, ...]}`
"""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from ingest.calibration.points.fit import PICKING
from omomo_core import strict_json
from omomo_core.errors import InputError

_MAX_BYTES = 2**20
Point = tuple[float, float, float]


@dataclass(frozen=True)
class PointPair:
    """One point, on the phone and in the object's frame."""

    phone: str | Point
    """Name of a point of the phone, or metres in its camera's axes."""
    object: Point
    """Metres (or the mesh's unit, when the scale is asked for)."""
    sigma: float = PICKING
    """By how much it is off along each axis, metres."""

    @property
    def name(self) -> str:
        """The point's name in messages."""
        return self.phone if isinstance(self.phone, str) else _written(self.phone)


def typed_pair(text: str, sigma: float = PICKING) -> PointPair:
    """The pair of "lens = 0.10 0.22 0.05".

    Raises:
        InputError: "pair-text".
    """
    phone, equals, there = text.partition("=")
    numbers = _numbers(there)
    if not equals or not phone.strip() or numbers is None:
        raise InputError(
            "pair-text",
            f"'{text}' is no pair of points.",
            fix='Write a point of the phone, "=", and its x y z on the object in metres: '
            '"lens = 0.10 0.22 0.05".',
        )
    return PointPair(_phone_point(phone), numbers, sigma)


def load_pairs(path: Path, sigma: float = PICKING) -> list[PointPair]:
    """Read a CSV or JSON file of pairs.

    Raises:
        InputError: "pairs-missing" or "pairs-unreadable" with the line or the item.
    """
    if not path.is_file():
        raise InputError(
            "pairs-missing",
            "There is no such file of pairs.",
            where=str(path),
            fix="Check the path.",
        )
    text = path.read_bytes()[:_MAX_BYTES].decode("utf-8-sig", "replace")
    if text.lstrip().startswith("{"):
        return _from_json(text, path, sigma)
    return _from_csv(text, path, sigma)


def save_pairs(pairs: Sequence[PointPair], path: Path) -> None:
    """Write the JSON that `load_pairs` reads."""
    items = [{"phone": p.phone, "object": p.object, "sigma_mm": 1e3 * p.sigma} for p in pairs]
    path.write_text(json.dumps({"pairs": items}, indent=2) + "\n", encoding="utf-8")


class _Item(BaseModel):
    model_config = ConfigDict(extra="forbid")
    phone: str | Point
    object: Point
    sigma_mm: float | None = Field(default=None, gt=0)


_ITEMS = TypeAdapter(dict[str, list[_Item]])


def _from_json(text: str, path: Path, sigma: float) -> list[PointPair]:
    try:
        items = _ITEMS.validate_python(strict_json.parse(text))["pairs"]
    except (ValueError, KeyError) as problem:
        what = str(problem)
        if isinstance(problem, ValidationError):
            error = problem.errors(include_url=False, include_input=False)[0]
            what = f"{'.'.join(str(part) for part in error['loc'])}: {error['msg']}"
        raise _unreadable(path, what) from None
    return [
        PointPair(item.phone, item.object, item.sigma_mm / 1e3 if item.sigma_mm else sigma)
        for item in items
    ]


def _from_csv(text: str, path: Path, sigma: float) -> list[PointPair]:
    pairs: list[PointPair] = []
    for number, row in enumerate(csv.reader(text.splitlines()), start=1):
        cells = [cell.strip() for cell in row]
        heading = number == 1 and cells[:1] == ["phone"]
        if heading or not any(cells) or cells[0].startswith("#"):
            continue
        there = _numbers(" ".join(cells[1:4])) if len(cells) in (4, 5) else None
        own = _numbers(f"{cells[4]} 0 0") if len(cells) == 5 and cells[4] else None
        if there is None or (len(cells) == 5 and cells[4] and (own is None or own[0] <= 0)):
            raise _unreadable(path, f"line {number} is not phone,x,y,z or phone,x,y,z,sigma_mm")
        pairs.append(PointPair(_phone_point(cells[0]), there, own[0] / 1e3 if own else sigma))
    return pairs


def _phone_point(text: str) -> str | Point:
    return _numbers(text) or text.strip()


def _numbers(text: str) -> Point | None:
    """Three numbers with blanks or commas between them."""
    try:
        x, y, z = (float(part) for part in text.replace(",", " ").split())
    except ValueError:
        return None
    return x, y, z


def _written(point: Point) -> str:
    return " ".join(f"{value:g}" for value in point)


def _unreadable(path: Path, what: str) -> InputError:
    return InputError(
        "pairs-unreadable",
        f"The file of pairs cannot be read: {what}.",
        where=str(path),
        fix='Write lines such as "lens,0.10,0.22,0.05" with metres, or JSON: '
        '{"pairs": [{"phone": "lens", "object": [0.1, 0.22, 0.05]}]}.',
    )
