"""One step of Gauss-Newton in which every sample has a drift of its own.

The drift is tied from each sample to the next, so that its part of the normal matrix is a band; it is
eliminated, and what is left are the eight numbers of mount, clock offset and scale.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64
from scipy.linalg import solveh_banded

from ingest.calibration.hand_eye.model import HandEyeFit, jacobians, weights
from ingest.calibration.hand_eye.samples import Samples

PRIOR_SD = np.array([3.0] * 3 + [0.5] * 3)
"""What is believed of a mount that nothing shows: any turn, half a metre."""
_OFFSET_SD = 0.1
_KNOWN_OFFSET_SD = 1e-6
_SCALE_SD = 0.02
"""Odometry, a board's squares and a lens disagree about lengths: by 2.5 % between two phones measured."""


class GaussNewtonStep(NamedTuple):
    """One step of Gauss-Newton, and the information matrix behind it."""

    own: Float64[np.ndarray, "8"]
    """Mount (rad, m), offset (s) and scale."""
    drift: Float64[np.ndarray, "n 6"]
    information: Float64[np.ndarray, "8 8"]
    """Of `own`, whatever the drift."""


def gauss_newton(fit: HandEyeFit, samples: Samples, *, timed: bool) -> GaussNewtonStep:
    """The step that explains the kept samples best, with a slow drift and a mount near the phone.

    Args:
        fit: where it stands.
        samples: both trackers at the fit's offset.
        timed: the offset is to be found too.
    """
    own, drift = jacobians(fit, samples)
    weight = weights(fit, samples) * fit.kept[:, None, None]
    pull = np.einsum("nij,nj->ni", weight, fit.errors)
    H_own = np.einsum("nki,nkl,nlj->ij", own, weight, own)
    g_own = np.einsum("nki,nk->i", own, pull)
    sd = np.append(PRIOR_SD, [_OFFSET_SD if timed else _KNOWN_OFFSET_SD, _SCALE_SD])
    H_own += np.diag(sd**-2)
    g_own[3:6] += fit.T_phone_target[:3, 3] / sd[3:6] ** 2
    g_own[6:] += np.array([fit.offset, fit.scale]) / sd[6:] ** 2
    drift_t = drift.swapaxes(-1, -2)
    across = (drift_t @ weight @ own).reshape(-1, 8)
    band, g_walk = _band(drift_t @ weight @ drift, fit, samples)
    g_drift = np.einsum("nij,nj->ni", drift_t, pull).reshape(-1) + g_walk
    solved = solveh_banded(band, np.column_stack([across, g_drift]), lower=True)
    information = H_own - across.T @ solved[:, :8]
    step = -np.linalg.solve(information, g_own - across.T @ solved[:, 8])
    walked = -(solved[:, 8] + solved[:, :8] @ step)
    return GaussNewtonStep(step, walked.reshape(-1, 6), (information + information.T) / 2)


def _band(
    blocks: Float64[np.ndarray, "n 6 6"], fit: HandEyeFit, samples: Samples
) -> tuple[Float64[np.ndarray, "12 rows"], Float64[np.ndarray, " rows"]]:
    """The drift's normal matrix with the walk's ties, as its lower diagonals; the ties' slope."""
    n = len(blocks)
    gaps = np.maximum(np.diff(samples.times), 1e-6)
    tie = 1 / (gaps[:, None] * np.repeat(fit.walk, 3) ** 2)
    beside = np.zeros((n, 6))
    beside[1:] += tie
    beside[:-1] += tie
    diagonal = blocks + beside[:, :, None] * np.eye(6)
    band = np.zeros((12, n, 6))
    for below in range(6):
        for column in range(6 - below):
            band[below, :, column] = diagonal[:, column + below, column]
    band[6, :-1] = -tie
    pull = np.zeros((n, 6))
    apart = tie * np.diff(fit.drift, axis=0)
    pull[1:] += apart
    pull[:-1] -= apart
    return band.reshape(12, -1), pull.reshape(-1)
