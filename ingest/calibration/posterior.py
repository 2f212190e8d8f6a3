"""The most likely rigid transform under residuals, and its covariance."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.uncertainty import between, moved, skew

_ROUNDS = 50
_STILL = 1e-10
"""rad and m of a step that is none."""


class Misfit(NamedTuple):
    """Whitened residuals of a transform, and their Jacobian."""

    residuals: Float64[np.ndarray, " n"]
    """Each with a standard deviation of 1 and independent of the others."""
    jacobian: Float64[np.ndarray, "n 6"]
    """By a step of `ingest.uncertainty.moved`."""


@dataclass(frozen=True)
class Posterior:
    """The most likely transform, and its covariance."""

    T: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """As in `ingest.uncertainty`."""
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
    for _ in range(_ROUNDS):
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
