"""Disagreement of the parts of a recording about the mount, relative to their noise.

The errors of trackers go on from one moment to the next in more ways than a model of them has: a tag's
place errs with the side it is seen from, stamps wander, odometry errs while it turns. So the recording
is cut into stretches, and what each pulls the mount to is compared with what its noise allows (the
"sandwich" of cluster-robust statistics, made one factor).
"""

import numpy as np
from jaxtyping import Float64
from scipy.linalg import solve_triangular
from scipy.stats import chi2, f

from ingest.calibration.hand_eye.model import HandEyeFit, jacobians, weights
from ingest.calibration.hand_eye.normal import PRIOR_SD
from ingest.calibration.hand_eye.samples import Samples
from ingest.calibration.posterior import whitener

_STRETCHES = (4, 8, 16)
"""Long ones show slow errors, many show quick ones more surely: the worst counts."""
_LEAST = 1.2
"""Noise and drift are themselves known from one recording only."""


def scatter(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "2"]:
    """The factors on the mount's variance, of its turn and of its shift; at least 1.2.

    Args:
        fit: of the samples, settled.
        samples: both trackers, the phone's poses at the fit's offset.
    """
    rows, errors = _innovations(fit, samples)
    n = len(errors)
    flat, left = rows.reshape(6 * n, -1), errors.reshape(-1)
    others = flat[:, 6:]
    own = flat[:, :6] - others @ np.linalg.lstsq(others, flat[:, :6])[0]
    left = left - flat @ np.linalg.lstsq(flat, left)[0]
    covariance = np.linalg.inv(own.T @ own + np.diag(PRIOR_SD**-2.0))
    pull = (own * left[:, None]).reshape(n, 6, 6).sum(axis=1) @ covariance
    return np.array(
        [
            max([_LEAST, *(_beyond(pull[:, part] @ W.T, k) for k in _STRETCHES if k <= n // 2)])
            for part in (slice(0, 3), slice(3, 6))
            for W in (whitener(covariance[part, part]),)
        ]
    )


def _beyond(pull: Float64[np.ndarray, "n 3"], many: int) -> float:
    """Mean square of the stretches' pulls, and what is needed since it is known from so few."""
    sums = np.stack([part.sum(axis=0) for part in np.array_split(pull, many)])
    free = 3 * (many - 1)
    few = 3 * float(f.ppf(0.95, 3, free)) / float(chi2.ppf(0.95, 3))
    return few * float((sums**2).sum()) / free * many


def _innovations(
    fit: HandEyeFit, samples: Samples
) -> tuple[Float64[np.ndarray, "n 6 14"], Float64[np.ndarray, "n 6"]]:
    """Innovation of each kept sample given those before it, in standard deviations.

    Of the errors, and of their slopes by mount, offset, scale and where the drift began.
    """
    own, drift = (slopes[fit.kept] for slopes in jacobians(fit, samples))
    undrifted = fit.errors[fit.kept] - np.einsum("nij,nj->ni", drift, fit.drift[fit.kept])
    n, since = len(own), samples.times[fit.kept] - samples.times[fit.kept][0]
    shared = np.minimum(since[:, None], since)
    walk = np.repeat(fit.walk, 3) ** 2
    covariance = (drift * walk).reshape(6 * n, 6) @ drift.reshape(6 * n, 6).T
    covariance *= np.repeat(np.repeat(shared, 6, axis=0), 6, axis=1)
    blocks = covariance.reshape(n, 6, n, 6)
    blocks[range(n), :, range(n), :] += np.linalg.inv(weights(fit, samples)[fit.kept])
    root = np.linalg.cholesky(covariance)
    both = np.concatenate([own, drift, undrifted[:, :, None]], axis=2).reshape(6 * n, 15)
    white = solve_triangular(root, both, lower=True).reshape(n, 6, 15)
    return white[:, :, :14], white[:, :, 14]
