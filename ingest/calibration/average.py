"""Robust mean of several estimates of one rigid transform."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.uncertainty import between, moved

_OUTLIER = float(chi2.ppf(0.999, 6))
_ROUNDS = 20
LEVER = 0.3
"""Metres from the phone at which a turn counts like a shift, when the two are compared."""


@dataclass(frozen=True)
class Average:
    """The mean of poses and how well it is known."""

    T: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Of `ingest.uncertainty`: rotation (rad), then translation (m), in T's outer axes."""
    kept: Bool[np.ndarray, " poses"]
    """False where a pose was too far off to be an estimate of the same transform."""


def average(
    T: Float64[np.ndarray, "poses 4 4"], covariances: Float64[np.ndarray, "poses 6 6"]
) -> Average:
    """The weighted mean of independent estimates of one transform.

    A pose farther from the middle than its covariance allows in 1 of 1,000 cases is left out. Where
    those kept scatter more than their covariances say, the result's covariance grows to match.

    Args:
        T: the estimates.
        covariances: of each, positive definite.
    """
    start, kept = _middle(T), np.ones(len(T), bool)
    mean, weights = T[start], np.linalg.inv(covariances)
    # The first middle is one of the estimates, as unsure as its covariance says.
    apart = np.linalg.inv(covariances + covariances[start])
    for _ in range(_ROUNDS):
        steps = between(mean[None], T)
        distance = np.einsum("pi,pij,pj->p", steps, apart, steps)
        # Half of the estimates are believed to be right: their spread sets the scale.
        growth = max(1.0, float(np.median(distance) / chi2.ppf(0.5, 6))) if len(T) > 2 else 1.0
        kept = distance < _OUTLIER * growth
        total = weights[kept].sum(axis=0)
        step = np.linalg.solve(total, np.einsum("pij,pj->i", weights[kept], steps[kept]))
        mean, apart = moved(mean, step), weights
        if np.abs(step).max() < 1e-12:
            break
    covariance = np.linalg.inv(weights[kept].sum(axis=0))
    return Average(mean, covariance * max(1.0, _scatter(mean, T[kept], weights[kept])), kept)


def _middle(T: Float64[np.ndarray, "poses 4 4"]) -> int:
    """Index of the one of the poses that is nearest to the others, by the median of its distances."""
    turns = Rotation.from_matrix(
        T[:, None, :3, :3].swapaxes(-1, -2).repeat(len(T), 1).reshape(-1, 3, 3)
    )
    others = Rotation.from_matrix(np.tile(T[:, :3, :3], (len(T), 1, 1)))
    angle = (others * turns).magnitude().reshape(len(T), len(T))
    shift = np.linalg.norm(T[:, None, :3, 3] - T[None, :, :3, 3], axis=-1)
    return int(np.argmin(np.median(LEVER * angle + shift, axis=1)))


def _scatter(
    mean: Float64[np.ndarray, "4 4"],
    T: Float64[np.ndarray, "poses 4 4"],
    weights: Float64[np.ndarray, "poses 6 6"],
) -> float:
    """How many times their covariances the poses scatter; 1 for a single one."""
    if len(T) < 2:
        return 1.0
    steps = between(mean[None], T)
    return float(np.einsum("pi,pij,pj->", steps, weights, steps)) / (6 * (len(T) - 1))
