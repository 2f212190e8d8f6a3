"""A rigid transform from the same points in two frames."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.stats import chi2, f

from ingest.calibration.points.pairs import PointPairs, check_line, check_pairs, explain, wild
from ingest.uncertainty import skew
from omomo_core.geometry.transforms import SimilarityTransform

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
    """Of `ingest.uncertainty`: rotation (rad), then translation (m), in a's axes."""
    residuals: Float64[np.ndarray, " n"]
    """How far apart the points of each pair stay, metres."""
    rms: float
    """Of the residuals of the pairs kept, metres."""
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
    return misfit / freedom * float(f.ppf(0.95, 3, freedom) / (chi2.ppf(0.95, 3) / 3))
