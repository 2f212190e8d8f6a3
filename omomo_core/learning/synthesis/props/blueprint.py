"""A thing as it is built, before anybody decides from which side to take it."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.shapes import Point, SolidPart

BarKind = Literal["pole", "rail", "handle"]


@dataclass(frozen=True)
class GripBar:
    """Something long that a hand closes around."""

    kind: BarKind
    a: Float[np.ndarray, " 3"]
    b: Float[np.ndarray, " 3"]
    """Ends of the stretch of the axis that hands may take."""
    uses: tuple[str, ...]


@dataclass(frozen=True)
class Blueprint:
    """A thing with its front at +x, standing on z = 0."""

    name: str
    parts: list[SolidPart]
    mass: float
    bars: list[GripBar] = field(default_factory=list)
    sides: tuple[float, float, float, float] = (0.25, 0.25, 0.25, 0.25)
    """How often people stand behind it (-x), at its right (-y), before it (+x), at its left (+y)."""
    wheels: bool = False
    stands: bool = True
    vessel: bool = False
    """Open at the top: its sides have a rim."""
    whole: bool = True
    """False when only its bars are held."""


def bar(kind: BarKind, a: Point, b: Point, *uses: str) -> GripBar:
    """A bar between two points."""
    return GripBar(kind, np.array(a, float), np.array(b, float), uses)


_QUARTERS = [
    np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]], float)
    for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))
]


def turned(plan: Blueprint, side: int) -> Blueprint:
    """The thing as seen by a person at one of its sides (see `Blueprint.sides`)."""
    matrix = _QUARTERS[side]
    return replace(
        plan,
        parts=[p.moved(matrix) for p in plan.parts],
        bars=[replace(b, a=matrix @ b.a, b=matrix @ b.b) for b in plan.bars],
    )
