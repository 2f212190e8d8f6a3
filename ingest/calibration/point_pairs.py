"""Method points: the same points measured on the phone and on the object.

A point on the phone is a name (`ingest.calibration.phone_body.body_point`) or three numbers in metres in the
axes of the phone's camera (as ARKit's: phone held sideways with the charging port to the right, x
right, y up, z to you). A point on the object is three numbers in metres in the frame of its mesh.

    phone,x,y,z,sigma_mm
    top left back corner,0.102,0.220,0.051,2
    0.01 -0.02 0.0,0.100,0.200,0.050,2
"""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError
from scipy.spatial import KDTree

from ingest.distributions import chi2_quantile, chi2_tail, f_quantile
from ingest.uncertainty import skew
from omomo_core import strict_json
from omomo_core.errors import InputError, in_words
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
    """Sigma of each pair along each axis, metres in a."""
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
        return bool(chi2_tail(fit.misfit, self.freedom) > chance)


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
            fix="Scale the mesh to metres, or ask for the scale too (‹scale›).",
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


PICKING = 0.002
"""Metres, along each axis, by which a point picked by hand is off."""
_CONTRADICTION = 1e-5
"""Chance of a misfit below which the pairs are said to contradict each other."""


@dataclass(frozen=True)
class PointFit:
    """The transform that lays points of b on points of a, and how well it is known."""

    T_a_b: Float64[np.ndarray, "4 4"]
    """Maps b's points, times `scale`, into a."""
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`: rotation (rad), then translation (m), in a's axes."""
    residuals: Float64[np.ndarray, " n"]
    """How far apart the points of each pair stay, metres."""
    rms: float
    """Root mean square of the residuals of the pairs kept, metres."""
    kept: Bool[np.ndarray, " n"]
    """False for a pair that contradicts all the others."""
    scale: float
    scale_sigma: float
    """One sigma of the scale, as a share of it; 0 when it was not asked for."""
    flat: bool
    """The points lie in a plane: were one frame left-handed, they would fit as well."""
    loose: bool
    """The pairs fit worse than their sigma allows; the covariance follows the misfit then."""


def rigid_from_points(
    points_a: Float64[np.ndarray, "n 3"],
    points_b: Float64[np.ndarray, "n 3"],
    sigma: float | Float64[np.ndarray, " n"] = PICKING,
    *,
    scaled: bool = False,
    names: Sequence[str] = (),
) -> PointFit:
    """The pose of frame b in frame a from three or more points known in both.

    One pair that contradicts all the others is left out (`PointFit.kept`).

    Args:
        points_a, points_b: the same points in a and in b, metres (b in any unit if `scaled`).
        sigma: how far a pair is off along each axis, metres in a; one for all, or one per pair.
        scaled: solve for the scale of b too (the paper's Procrustes).
        names: of the pairs, for messages; "pair 1"... if not given.

    Raises:
        InputError: "points-few", "points-not-finite", "points-duplicate", "points-units",
            "points-collinear", "points-mirrored", "points-scale" or "points-wild".
    """
    spread = np.broadcast_to(np.asarray(sigma, float), len(points_a)).copy()
    labels = tuple(names) or tuple(f"pair {i + 1}" for i in range(len(points_a)))
    everything = PointPairs(points_a, points_b, spread, labels, scaled)
    check_pairs(everything)
    pairs, kept = _without_wild(everything)
    fit = pairs.fit()
    off = np.linalg.norm(points_a - (fit.scale * points_b @ fit.R.T + fit.t), axis=1)
    covariance, scale_sigma = _covariance(pairs, fit)
    loose = not pairs.agree(fit, 0.05)
    growth = _growth(fit.misfit, pairs.freedom) if loose else 1.0
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = fit.R, fit.t
    return PointFit(
        T_a_b=T,
        covariance=covariance * growth,
        residuals=off,
        rms=float(np.sqrt((off[kept] ** 2).mean())),
        kept=kept,
        scale=fit.scale,
        scale_sigma=scale_sigma * growth**0.5,
        flat=loose or pairs.agree(pairs.fit(mirrored=True)),
        loose=loose,
    )


def _without_wild(pairs: PointPairs) -> tuple[PointPairs, Bool[np.ndarray, " n"]]:
    """The pairs that agree, and which ones those are."""
    kept = np.ones(len(pairs.a), bool)
    if pairs.agree(pairs.fit(), _CONTRADICTION):
        return pairs, kept
    explain(pairs)
    worst = wild(pairs)
    if worst is None:
        return pairs, kept
    kept[worst] = False
    rest = pairs.without(worst)
    check_line(rest)
    return rest, kept


def _covariance(
    pairs: PointPairs, fit: SimilarityTransform
) -> tuple[Float64[np.ndarray, "6 6"], float]:
    """Covariance of rotation and translation, and one sigma of the logarithm of the scale."""
    arms = fit.scale * pairs.b @ fit.R.T
    moves = [-skew(arms), np.broadcast_to(np.eye(3), (len(arms), 3, 3)), arms[:, :, None]]
    J = np.concatenate(moves if pairs.scaled else moves[:2], axis=2)
    covariance = np.linalg.inv(np.einsum("nki,n,nkj->ij", J, pairs.weights, J))
    return covariance[:6, :6], float(covariance[6, 6] ** 0.5) if pairs.scaled else 0.0


def _growth(misfit: float, freedom: int) -> float:
    """Factor of the covariance when the misfit, not the stated sigma, tells the error.

    The F distribution takes the place of the chi-square of a 95 % radius in space, because the
    misfit of few pairs is itself a rough guess.
    """
    return misfit / freedom * float(f_quantile(0.95, 3, freedom) / (chi2_quantile(0.95, 3) / 3))


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
    """Sigma along each axis, metres."""

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
        what = in_words(problem)
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
