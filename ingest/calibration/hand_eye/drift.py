"""How far the phone's world drifted against the other tracker, and whether odometry can be so bad."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import median_filter
from scipy.spatial.distance import pdist

from ingest.calibration.hand_eye.model import HandEyeFit, errors, world
from ingest.calibration.hand_eye.samples import Samples
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_WINDOW, _LEAST = 2.0, 6
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
        if end - first < _LEAST or len(wild) < _NEARLY_ALL * (end - first):
            continue
        steps = np.linalg.norm(np.diff(off[wild], axis=0), axis=1)
        if np.median(steps) < _SMOOTH * np.median(np.linalg.norm(off[wild], axis=1)):
            lost[wild] = True
    return lost


def _path(places: Float64[np.ndarray, "n 3"]) -> float:
    """Length of a path; each place is the mean of three, since noise walks too."""
    smooth = (places[:-2] + places[1:-1] + places[2:]) / 3 if len(places) > 3 else places
    return float(np.linalg.norm(np.diff(smooth, axis=0), axis=1).sum())
