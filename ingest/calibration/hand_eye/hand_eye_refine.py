"""Refinement of AX = ZB by Gauss-Newton: mount, drift, clocks, noise.

The errors of trackers go on from one moment to the next in more ways than a model of them has: a tag's
place errs with the side it is seen from, stamps wander, odometry errs while it turns. So the recording
is cut into stretches, and what each pulls the mount to is compared with what its noise allows (the
"sandwich" of cluster-robust statistics, made one factor).

How noisy turns and shifts are, how fast the world drifts and which samples are wild is asked of the
data between the steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.linalg import solve_triangular
from scipy.ndimage import median_filter
from scipy.optimize import root_scalar
from scipy.spatial.distance import pdist

from ingest.calibration.hand_eye.hand_eye_model import (
    PHONE_SD,
    PRIOR_SD,
    HandEyeFit,
    Samples,
    errors,
    gauss_newton,
    jacobians,
    target_velocity,
    weights,
    whitened,
    world,
)
from ingest.calibration.posterior import LEVER, whitener
from ingest.distributions import chi2_quantile, f_quantile
from ingest.uncertainty import moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_STRETCHES = (4, 8, 16)
"""Long ones show slow errors, many show quick ones more surely: the worst counts."""
_LEAST_SCATTER = 1.2
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
            max(
                [
                    _LEAST_SCATTER,
                    *(_beyond(pull[:, part] @ W.T, k) for k in _STRETCHES if k <= n // 2),
                ]
            )
            for part in (slice(0, 3), slice(3, 6))
            for W in (whitener(covariance[part, part]),)
        ]
    )


def _beyond(pull: Float64[np.ndarray, "n 3"], many: int) -> float:
    """Mean square of the stretches' pulls, and what is needed since it is known from so few."""
    sums = np.stack([part.sum(axis=0) for part in np.array_split(pull, many)])
    free = 3 * (many - 1)
    few = 3 * f_quantile(0.95, 3, free) / chi2_quantile(0.95, 3)
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


_ROUNDS, _FIRST = 30, 4
_WILD = chi2_quantile(0.999, 6)
_HALF_1, _HALF, _MIDDLE = (chi2_quantile(0.5, k) for k in (1, 3, 6))
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


_WINDOW, _LEAST_DRIFT = 2.0, 6
"""Seconds, and samples in them, of which nearly all are wild where tracking is lost."""
_NEARLY_ALL = 0.8
_SMOOTH = 0.5
"""Part of its distance by which lost tracking goes on from sample to sample; outliers jump farther."""
_OUTLIERS = 5
"""Samples over which the median of lost tracking is taken."""
_MOST, _MOST_PER_METRE = 0.1, 0.04
"""Drift that is believed, metres and per metre walked: odometry that works does 0.5 to 2 %, seldom 4."""
_MOST_OF_BROKEN = 0.02
"""The same per metre where nothing fits for seconds: that is less like drift."""


@dataclass(frozen=True)
class Drift:
    """The drift that a fit takes out, and the stretches it leaves out because tracking was lost."""

    metres: float
    """Between the two places that one resting point near the target had in the phone's world."""
    walked: float
    """Metres of the phone's path, by the tracker that has the shorter one."""
    lost: Bool[np.ndarray, " n"]
    """Samples where the trackers have gone apart for seconds, though each goes on smoothly."""

    @property
    def per_metre(self) -> float:
        """Drift per metre walked."""
        return self.metres / max(self.walked, 1e-3)


def drift_of(fit: HandEyeFit, samples: Samples) -> Drift:
    """The drift of a fit, over what it kept and over where tracking was lost."""
    rest = _at_rest(fit)
    seen = samples.T_camera_target
    off = (world(fit) @ seen - world(rest) @ seen)[:, :3, 3]
    # Where nothing fits, the fit has no drift: what lies between both trackers is it.
    off[~fit.kept] = errors(rest, samples)[~fit.kept, 3:]
    lost = _lost(off, fit.kept, samples.times)
    if lost.any():  # single poses that are wild stay wild in it
        off[lost] = median_filter(off[lost], (_OUTLIERS, 1), mode="mirror")
    known = off[fit.kept | lost]
    phone = samples.T_world_phone[:, :3, 3]
    other = (seen @ inverse(fit.T_phone_target))[:, :3, 3]
    walked = min(_path(phone[fit.kept | lost]), _path(other[fit.kept | lost]))
    return Drift(float(pdist(known).max(initial=0.0)), walked, lost)


def undrifted(fit: HandEyeFit, samples: Samples) -> Float64[np.ndarray, "2"]:
    """Rms error of turns (rad) and shifts (m) of the kept samples with the phone's world at rest."""
    left = errors(_at_rest(fit), samples)[fit.kept].reshape(-1, 2, 3)
    return np.sqrt((left**2).sum(axis=-1).mean(axis=0))


def check_drift(drift: Drift, fit: HandEyeFit, samples: Samples) -> None:
    """Refuse odometry that drifted more than any that works: "calibration-lost"."""
    part = _MOST_OF_BROKEN if drift.lost.any() else _MOST_PER_METRE
    most = max(_MOST, part * drift.walked)
    if drift.metres <= most:
        return
    times = samples.times - samples.times[0]
    when = times[drift.lost] if drift.lost.any() else times
    phone = np.ptp(samples.T_world_phone[:, :3, 3], axis=0)
    other = np.ptp((samples.T_camera_target @ inverse(fit.T_phone_target))[:, :3, 3], axis=0)
    whose = "phone's" if np.linalg.norm(phone) > np.linalg.norm(other) else "other tracker's"
    raise InputError(
        "calibration-lost",
        f"The {whose} log lost its way: the two go apart by {drift.metres:.2f} m in "
        f"{drift.walked:.1f} m walked ({drift.per_metre:.2f} m per metre), where such tracking drifts "
        f"by {most:.2f} m at most. In the phone's log it wanders over {_metres(phone)}, in the other "
        f"tracker's over {_metres(other)}.",
        where=f"{when[0]:.1f} s to {when[-1]:.1f} s after both have begun",
        fix="Cut those seconds off the log, or record again: light, much to see around, slower turns, "
        "and a few seconds of walking about before the object is turned.",
    )


def _metres(size: Float64[np.ndarray, "3"]) -> str:
    return " x ".join(f"{length:.1f}" for length in size) + " m"


def _at_rest(fit: HandEyeFit) -> HandEyeFit:
    """The fit with the drift that it has in the middle of the recording's, all along."""
    middle = np.median(fit.drift[fit.kept], axis=0)
    return replace(fit, drift=np.tile(middle, (len(fit.drift), 1)))


def _lost(
    off: Float64[np.ndarray, "n 3"], kept: Bool[np.ndarray, " n"], times: Float64[np.ndarray, " n"]
) -> Bool[np.ndarray, " n"]:
    """Wild samples of stretches of seconds in which nearly all are wild, and all alike."""
    lost = np.zeros(len(times), bool)
    for first, start in enumerate(times):
        end = int(np.searchsorted(times, start + _WINDOW, side="right"))
        wild = np.flatnonzero(~kept[first:end]) + first
        if end - first < _LEAST_DRIFT or len(wild) < _NEARLY_ALL * (end - first):
            continue
        steps = np.linalg.norm(np.diff(off[wild], axis=0), axis=1)
        if np.median(steps) < _SMOOTH * np.median(np.linalg.norm(off[wild], axis=1)):
            lost[wild] = True
    return lost


def _path(places: Float64[np.ndarray, "n 3"]) -> float:
    """Length of a path; each place is the mean of three, since noise walks too."""
    smooth = (places[:-2] + places[1:-1] + places[2:]) / 3 if len(places) > 3 else places
    return float(np.linalg.norm(np.diff(smooth, axis=0), axis=1).sum())
