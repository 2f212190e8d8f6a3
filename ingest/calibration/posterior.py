"""Least squares on a pose with outliers, its covariance, and what stays unobservable."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.distributions import chi2_quantile
from ingest.uncertainty import between, moved, skew

_POSTERIOR_ROUNDS = 50
_STILL = 1e-10
"""rad and m of a step that is none."""


class Misfit(NamedTuple):
    """Whitened residuals of a transform, and their Jacobian."""

    residuals: Float64[np.ndarray, " n"]
    """Each with a standard deviation of 1 and independent of the others."""
    jacobian: Float64[np.ndarray, "n 6"]
    """Derivative by a step of `ingest.uncertainty.moved`."""


@dataclass(frozen=True)
class Posterior:
    """The most likely transform, and its covariance."""

    T: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`."""
    cost: float
    """Sum of the squared residuals."""


def posterior(
    misfit: Callable[[Float64[np.ndarray, "4 4"]], Misfit], start: Float64[np.ndarray, "4 4"]
) -> Posterior:
    """Least squares over rotations and translations, by Gauss-Newton.

    Args:
        misfit: of a transform; its residuals see every direction between them, as a prior does.
        start: within some tens of degrees of the answer.
    """
    best = start
    for _ in range(_POSTERIOR_ROUNDS):
        residuals, jacobian = misfit(best)
        step = -np.linalg.lstsq(jacobian, residuals)[0]
        best = moved(best, step)
        if np.abs(step).max() < _STILL:
            break
    residuals, jacobian = misfit(best)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    return Posterior(best, (covariance + covariance.T) / 2, float(residuals @ residuals))


def belief(
    T: Float64[np.ndarray, "4 4"], covariance: Float64[np.ndarray, "6 6"]
) -> Callable[[Float64[np.ndarray, "4 4"]], Misfit]:
    """How far transforms are from one that is known this well."""
    W = whitener(covariance)

    def misfit(other: Float64[np.ndarray, "4 4"]) -> Misfit:
        step = between(T, other)
        return Misfit(W @ step, W @ _growth(step))

    return misfit


def joined(*misfits: Misfit) -> Misfit:
    """Stack several sets of residuals into one."""
    return Misfit(*(np.concatenate(parts) for parts in zip(*misfits, strict=True)))


def whitener(covariance: Float64[np.ndarray, "n n"]) -> Float64[np.ndarray, "n n"]:
    """W with which W @ residual has unit covariance."""
    return np.linalg.inv(np.linalg.cholesky(covariance))


def _growth(step: Float64[np.ndarray, "6"]) -> Float64[np.ndarray, "6 6"]:
    """How `between(T, other)`, which is this step, changes when `other` moves.

    The turn changes by the inverse of the left Jacobian of SO(3), written as a series.
    """
    turn = skew(step[:3])
    J = np.eye(6)
    J[:3, :3] += -turn / 2 + turn @ turn / 12 - turn @ turn @ turn @ turn / 720
    return J


_OUTLIER = chi2_quantile(0.999, 6)
_AVERAGE_ROUNDS = 20
LEVER = 0.3
"""Metres from the phone at which a turn counts like a shift, when the two are compared."""


@dataclass(frozen=True)
class Average:
    """The mean of poses and how well it is known."""

    T: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`: rotation (rad), then translation (m), in T's outer axes."""
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
    for _ in range(_AVERAGE_ROUNDS):
        steps = between(mean[None], T)
        distance = np.einsum("pi,pij,pj->p", steps, apart, steps)
        # Half of the estimates are believed to be right: their spread sets the scale.
        growth = max(1.0, float(np.median(distance) / chi2_quantile(0.5, 6))) if len(T) > 2 else 1.0
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


OPEN_M = 0.03
"""A direction whose standard deviation is more than this, metres (or its angle at LEVER), is open."""
TILT_IT = (
    "Pushing on the floor leaves the height free: fix it by the floor (omocap calibrate floor), or "
    "tilt the object by 20 degrees in two directions while recording."
)


@dataclass(frozen=True)
class OpenDirection:
    """One way in which the mount could be another and the recording look the same."""

    words: str
    step: Float64[np.ndarray, "6"]
    """Rotation vector and translation in the phone's axes; of length 1 with turns at LEVER."""
    sd: float
    """Metres."""


def open_directions(
    covariance: Float64[np.ndarray, "6 6"],
    vertical: Float64[np.ndarray, "3"] | None = None,
) -> tuple[OpenDirection, ...]:
    """The directions of a mount's covariance that are as good as unknown, the widest first.

    Args:
        covariance: rotation (rad) and translation (m) in the phone's axes.
        vertical: unit vector in the phone's axes that stayed upright through the recording, if any.
    """
    scale = np.array([LEVER] * 3 + [1.0] * 3)
    values, vectors = np.linalg.eigh(covariance * np.outer(scale, scale))
    return tuple(
        OpenDirection(_words(vectors[:, k], vertical), vectors[:, k] / scale, float(np.sqrt(value)))
        for k, value in reversed(list(enumerate(values.clip(0))))
        if value > OPEN_M**2
    )


def _words(vector: Float64[np.ndarray, "6"], vertical: Float64[np.ndarray, "3"] | None) -> str:
    turn, shift = vector[:3], vector[3:]
    if np.linalg.norm(turn) > np.linalg.norm(shift):
        return f"the turn about {_axis(turn, vertical)}"
    if vertical is not None and abs(shift @ vertical) > 0.8 * np.linalg.norm(shift):
        return "the height of the object"
    return f"the place of the object along {_axis(shift, vertical)}"


def _axis(vector: Float64[np.ndarray, "3"], vertical: Float64[np.ndarray, "3"] | None) -> str:
    """The nearest of the directions that a person knows."""
    unit = vector / np.linalg.norm(vector)
    if vertical is not None and abs(unit @ vertical) > 0.8:
        return "the vertical"
    names = ("the camera's x (right)", "the camera's y (up)", "the camera's z (the way it looks)")
    nearest = int(np.argmax(np.abs(unit)))
    if abs(unit[nearest]) > 0.9:
        return names[nearest]
    return f"({', '.join(f'{x:.2f}' for x in unit)}) in the camera's axes"
