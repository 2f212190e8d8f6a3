"""Corresponding points in two frames, and the checks of such a list."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.spatial import KDTree
from scipy.stats import chi2

from omomo_core.errors import InputError
from omomo_core.geometry.transforms import SimilarityTransform, procrustes

_SAME = 1e-6
_UNITS = {1000: "millimetres", 100: "centimetres", 39.37: "inches"}
_UNIT_TOLERANCE = 0.1
_MAX_TURN = 0.2
"""Radians (one sigma) of the least certain turn, beyond which it counts as open."""
_MIN_SCALE = 0.01


@dataclass(frozen=True)
class PointPairs:
    """Points of frame b and the same ones in frame a."""

    a: Float64[np.ndarray, "n 3"]
    """Metres."""
    b: Float64[np.ndarray, "n 3"]
    """Metres; in any unit if `scaled`."""
    sigma: Float64[np.ndarray, " n"]
    """By how much each pair is off along each axis, metres in a."""
    names: tuple[str, ...]
    scaled: bool
    """Whether the scale of b is to be found."""

    @property
    def weights(self) -> Float64[np.ndarray, " n"]:
        """Weight of each pair; with it the misfit is a chi-square."""
        return self.sigma**-2.0

    @property
    def freedom(self) -> int:
        """Measurements beyond those that the transform uses up."""
        return 3 * len(self.a) - (7 if self.scaled else 6)

    @property
    def unit(self) -> float:
        """Roughly metres of a per unit of b."""
        return _size(self.a) / max(_size(self.b), 1e-12) if self.scaled else 1.0

    def without(self, i: int) -> "PointPairs":
        """All the pairs but one."""
        keep = np.arange(len(self.a)) != i
        names = tuple(name for j, name in enumerate(self.names) if j != i)
        return PointPairs(self.a[keep], self.b[keep], self.sigma[keep], names, self.scaled)

    def fit(self, *, mirrored: bool = False, scaled: bool = False) -> SimilarityTransform:
        """The best transform, with a scale if these pairs or the caller ask for one."""
        scaled = scaled or self.scaled
        return procrustes(self.a, self.b, self.weights, scaled=scaled, mirrored=mirrored)

    def agree(self, fit: SimilarityTransform, chance: float = 1e-3) -> bool:
        """Whether right pairs have so large a misfit at least with this chance."""
        return bool(chi2.sf(fit.misfit, self.freedom) > chance)


def check_pairs(pairs: PointPairs) -> None:
    """Refuse what can be seen before any fit.

    Raises:
        InputError: "points-few", "points-not-finite", "points-duplicate", "points-units" or
            "points-collinear".
    """
    _check_numbers(pairs)
    _check_units(pairs)
    _check_duplicates(pairs)
    check_line(pairs)


def _check_numbers(pairs: PointPairs) -> None:
    if len(pairs.a) < 3:
        raise InputError(
            "points-few",
            f"{len(pairs.a)} pair(s) of points do not fix a pose.",
            fix="Give three or more that are not in a line; a fourth shows a mistake.",
        )
    for frame in (pairs.a, pairs.b, pairs.sigma[:, None]):
        bad = ~np.isfinite(frame).all(axis=1)
        if bad.any():
            raise InputError(
                "points-not-finite",
                f"{pairs.names[int(bad.argmax())]} holds NaN or infinity.",
                fix="Measure it again, or leave it out.",
            )


def _check_units(pairs: PointPairs) -> None:
    """Refuse frames in different units, which no rigid transform joins."""
    sizes = _size(pairs.a), _size(pairs.b)
    if pairs.scaled or min(sizes) < _SAME:
        return
    for factor, unit in _UNITS.items():
        for ratio, which in ((sizes[0] / sizes[1], "first"), (sizes[1] / sizes[0], "second")):
            if abs(np.log(ratio / factor)) < _UNIT_TOLERANCE:
                raise InputError(
                    "points-units",
                    f"The {which} points of the pairs lie {ratio:.4g} times as far apart as the "
                    f"others: they look like {unit}.",
                    fix=f"Divide them by {factor:g}: points are in metres.",
                )


def _check_duplicates(pairs: PointPairs) -> None:
    """Refuse one pair told twice, and a point of one frame that is two in the other."""
    b = pairs.b * pairs.unit
    for here, there in ((pairs.a, b), (b, pairs.a)):
        for i, j in sorted(KDTree(here).query_pairs(_SAME)):
            apart = float(np.linalg.norm(there[i] - there[j]))
            if apart <= _SAME or apart > 10 * pairs.sigma[[i, j]].max():
                raise InputError(
                    "points-duplicate",
                    f"{pairs.names[i]} and {pairs.names[j]} are the same point in one frame and "
                    f"{1e3 * apart:.1f} mm apart in the other.",
                    fix="Leave one of them out, or correct it.",
                )


def check_line(pairs: PointPairs) -> None:
    """Refuse points in a line, about which the object is free to turn.

    Raises:
        InputError: "points-collinear".
    """
    for which, points in (("first", pairs.a), ("second", pairs.b * pairs.unit)):
        share = pairs.weights / pairs.weights.sum()
        spread = (points - share @ points) / pairs.sigma[:, None]
        across = float(np.linalg.svd(spread, compute_uv=False)[1])
        if across * _MAX_TURN < 1:
            raise InputError(
                "points-collinear",
                f"The {which} points of the pairs are in a line, or nearly: the turn about the "
                "line through the points is open.",
                fix="Add a point well beside that line, the farther the better.",
            )


def explain(pairs: PointPairs) -> None:
    """Refuse pairs that do not fit as they are, but do as a mirror image or at another scale.

    Raises:
        InputError: "points-mirrored" or "points-scale".
    """
    if pairs.agree(pairs.fit(mirrored=True)):
        raise InputError(
            "points-mirrored",
            "The points fit as a mirror image only: one of the two frames is left-handed.",
            fix="Turn the sign of one axis round. In a right-handed frame, with x to the right and "
            "y up, z points to you.",
        )
    scaled = pairs.fit(scaled=True)
    if not pairs.scaled and pairs.agree(scaled) and abs(np.log(scaled.scale)) > _MIN_SCALE:
        raise InputError(
            "points-scale",
            f"The points fit only if the second ones are scaled by {scaled.scale:.4g}.",
            fix="Scale the mesh to metres, or ask for the scale too (--scale).",
        )


def wild(pairs: PointPairs) -> int | None:
    """Which pair contradicts all the others, for pairs that do not fit; None if no single one does.

    Raises:
        InputError: "points-wild", when it could be one of several, or three pairs disagree.
    """
    if len(pairs.a) == 3:
        raise InputError(
            "points-wild",
            "The three pairs do not fit: the points are not as far apart in one frame as in the "
            f"other, {1e3 * _worst_side(pairs):.0f} mm off at worst.",
            fix="Measure them again; a fourth pair would show which one is wrong.",
        )
    rests = [pairs.without(i) for i in range(len(pairs.a))]
    right = [i for i, rest in enumerate(rests) if rest.agree(rest.fit())]
    if len(right) > 1:
        raise InputError(
            "points-wild",
            "The pairs do not fit together, but would without "
            f"{' or without '.join(pairs.names[i] for i in right)}.",
            fix="Measure those again, or add another pair.",
        )
    return right[0] if right else None


def _worst_side(pairs: PointPairs) -> float:
    """The largest difference of a distance between two points in a and in b, metres."""
    a, b = (np.linalg.norm(p[:, None] - p[None], axis=-1) for p in (pairs.a, pairs.unit * pairs.b))
    return float(np.abs(a - b).max())


def _size(points: Float64[np.ndarray, "n 3"]) -> float:
    return float(np.linalg.norm(points - points.mean(axis=0)))
