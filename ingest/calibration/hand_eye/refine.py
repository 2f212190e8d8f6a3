"""Gauss-Newton on AX = ZB in absolute poses: mount, drift of the phone's world, offset of the clocks.

How noisy turns and shifts are, how fast the world drifts and which samples are wild is asked of the
data between the steps.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float64
from scipy.optimize import root_scalar
from scipy.stats import chi2

from ingest.calibration.average import LEVER
from ingest.calibration.hand_eye.model import HandEyeFit, errors, target_velocity, weights, whitened
from ingest.calibration.hand_eye.normal import PRIOR_SD, gauss_newton
from ingest.calibration.hand_eye.samples import PHONE_SD, Samples
from ingest.calibration.hand_eye.scatter import scatter
from ingest.uncertainty import moved
from omomo_core.geometry.transforms import inverse

_ROUNDS, _FIRST = 30, 4
_WILD = float(chi2.ppf(0.999, 6))
_HALF_1, _HALF, _MIDDLE = (float(chi2.ppf(0.5, k)) for k in (1, 3, 6))
_NOISE_LEAST = np.array([0.2, 0.2])
_WALK_START, _WALK_LEAST = np.array([1e-3, 4e-3]), np.array([1e-6, 1e-6])
"""Drift in the square root of a second, rad and m."""
_JITTER_START = 0.02
_LEAST_JITTER = np.radians(0.05)
_SETTLED = 0.02
"""Part of its standard deviation below which a step is the last."""


def refine(
    samples: Samples,
    start: Float64[np.ndarray, "4 4"],
    again: Callable[[float], Samples] | None = None,
) -> HandEyeFit:
    """The best fit from a start that is about right.

    Args:
        samples: of both trackers.
        start: a first T_phone_target.
        again: the samples for another clock offset (added to that of `samples`); None when the
            poses belong together one by one, which also means that nothing drifts between them.
    """
    drifts = again is not None
    fit = _begin(samples, start, drifts=drifts)
    for turn in range(_ROUNDS):
        now = again(fit.offset) if again else samples
        fit = replace(fit, errors=errors(fit, now))
        step = gauss_newton(fit, now, timed=drifts)
        fit = replace(
            fit,
            T_phone_target=moved(fit.T_phone_target, step.own[:6]),
            offset=fit.offset + float(step.own[6]),
            scale=fit.scale + float(step.own[7]),
            drift=fit.drift + step.drift,
            information=step.information,
        )
        fit = replace(fit, errors=errors(fit, now))
        fit = _sized(fit, now, drifts=drifts) if turn < _FIRST else _without_wild(fit, now)
        if turn > _FIRST and step.own @ step.information @ step.own < _SETTLED**2:
            break
    return fit


def mount_covariance(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "6 6"]:
    """Covariance of the mount, for errors correlated over time and jitter of the rotations.

    A jitter of the phone's turns looks like turning, and would show a little of every direction:
    what it can show is taken out of the information.
    """
    H = fit.information
    shown = H[:6, :6] - H[:6, 6:] @ np.linalg.solve(H[6:, 6:], H[6:, :6]) - np.diag(PRIOR_SD**-2.0)
    shown[3:, 3:] -= _shown_by_jitter(fit, samples)
    scale = np.array([LEVER] * 3 + [1.0] * 3)
    values, vectors = np.linalg.eigh(shown / np.outer(scale, scale))
    shown = (vectors * values.clip(0)) @ vectors.T * np.outer(scale, scale)
    wider = np.sqrt(np.repeat(scatter(fit, samples), 3))
    return np.linalg.inv(shown + np.diag(PRIOR_SD**-2.0)) * np.outer(wider, wider)


def _shown_by_jitter(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "3 3"]:
    """Information on the mount's translation from the turns' noise alone, in the phone's axes."""
    R = samples.T_world_phone[fit.kept, :3, :3]
    gap = np.median(np.diff(samples.times[fit.kept]))
    # The drift explains what lasts: only so much as happens between two samples informs.
    noise = np.linalg.inv(weights(fit, samples)[fit.kept][:, 3:, 3:])
    noise += 0.5 * gap * fit.walk[1] ** 2 * np.eye(3)
    weight = R.swapaxes(-1, -2) @ np.linalg.inv(noise) @ R
    jitter = max(_LEAST_JITTER, PHONE_SD[0] * float(fit.noise[0]))
    trace = np.trace(weight, axis1=1, axis2=2)[:, None, None]
    return jitter**2 * (trace * np.eye(3) - weight).sum(axis=0)


def _begin(samples: Samples, X: Float64[np.ndarray, "4 4"], *, drifts: bool) -> HandEyeFit:
    Z = samples.T_world_phone @ X @ inverse(samples.T_camera_target)
    n = len(samples.times)
    fit = HandEyeFit(
        T_phone_target=X,
        T_world_camera=Z[np.argmin(np.abs(Z - np.median(Z, axis=0)).sum(axis=(1, 2)))],
        drift=np.zeros((n, 6)),
        centre=np.median(samples.T_world_phone[:, :3, 3], axis=0),
        offset=0.0,
        scale=0.0,
        noise=np.ones(2),
        jitter=_JITTER_START if drifts else 0.0,
        walk=_WALK_START if drifts else _WALK_LEAST,
        kept=np.ones(n, bool),
        information=np.eye(8),
        errors=np.zeros((n, 6)),
    )
    return _without_wild(replace(fit, errors=errors(fit, samples)), samples)


def _sized(fit: HandEyeFit, samples: Samples, *, drifts: bool) -> HandEyeFit:
    """The fit with the noise and the drift that its errors show, and without the wild samples.

    Errors with the drift left in part the more the longer they are apart: half of the squared
    difference over a lag is the noise plus half the walk times the lag.
    """
    still = replace(fit, drift=np.zeros_like(fit.drift), noise=np.ones(2), jitter=0.0)
    still = replace(still, errors=errors(still, samples))
    root = np.linalg.cholesky(weights(still, samples))
    white = np.einsum("nji,nj->ni", root, still.errors)
    if not drifts:
        square = (white.reshape(-1, 2, 3) ** 2).sum(axis=-1)
        noise, walk = np.sqrt(np.median(square, axis=0) / _HALF), fit.walk
    else:
        along = target_velocity(fit, samples)
        white_along = np.einsum("nji,nj->ni", root, along)
        noise, walk = np.empty(2), np.empty(2)
        for part, at in enumerate((slice(0, 3), slice(3, 6))):
            k, t = fit.kept, samples.times[fit.kept]
            noise[part], _ = _noise_and_walk(white[k, at], white_along[k, at], t)
            _, walk[part] = _noise_and_walk(still.errors[k, at], along[k, at], t)
    fit = replace(fit, noise=np.maximum(noise, _NOISE_LEAST), walk=np.maximum(walk, _WALK_LEAST))
    return _without_wild(replace(fit, jitter=_jitter(fit, samples) if drifts else 0.0), samples)


def _jitter(fit: HandEyeFit, samples: Samples) -> float:
    """Seconds by which stamps err: what is left along the motion beyond what other noise leaves there."""
    along = target_velocity(fit, samples)[fit.kept]
    weight = weights(replace(fit, jitter=0.0), samples)[fit.kept]
    shown = np.einsum("ni,nij,nj->n", along, weight, along)
    late = np.einsum("ni,nij,nj->n", along, weight, fit.errors[fit.kept]) / np.maximum(shown, 1e-12)

    def excess(jitter: float) -> float:
        return float(np.median(late**2 / (1 / np.maximum(shown, 1e-12) + jitter**2))) - _HALF_1

    if not excess(0.0) > 0 > excess(1.0):
        return 0.0
    return float(root_scalar(excess, bracket=(0.0, 1.0), xtol=1e-5).root)


def _without_wild(fit: HandEyeFit, samples: Samples) -> HandEyeFit:
    """The fit with noise as half of its errors show if that is more, and with the samples it allows."""
    square = (whitened(fit, samples) ** 2).sum(axis=1)
    growth = max(1.0, float(np.median(square)) / _MIDDLE)
    return replace(fit, noise=fit.noise * np.sqrt(growth), kept=square < _WILD * growth)


def _noise_and_walk(
    series: Float64[np.ndarray, "n 3"],
    along: Float64[np.ndarray, "n 3"],
    times: Float64[np.ndarray, " n"],
) -> tuple[float, float]:
    """Standard deviation of a component's noise, and of its walk in the square root of a second.

    Only what is across the motion (`along`) at both ends of a difference counts: errors of the stamps
    are along it.
    """
    lags = np.unique(np.geomspace(1, max(2, len(times) // 3), 8).astype(int))
    lags = lags[lags < len(times)]
    unit = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    outer = unit[:, :, None] * unit[:, None, :]
    apart = np.array([np.median(times[lag:] - times[:-lag]) for lag in lags])
    half = np.empty(len(lags))
    for k, lag in enumerate(lags):
        across = np.linalg.eigh(outer[lag:] + outer[:-lag])[1][:, :, 0]
        off = ((series[lag:] - series[:-lag]) * across).sum(axis=1)
        half[k] = np.median(off**2) / (2 * _HALF_1)
    slope, start = np.polyfit(apart, half, 1, w=1 / np.maximum(half, 1e-12))
    return float(np.sqrt(max(start, 0.0))), float(np.sqrt(max(2 * slope, 0.0)))
