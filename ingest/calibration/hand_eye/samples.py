"""The moments at which both trackers saw the object, and what their noise is taken to be."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from ingest.calibration.hand_eye.streams import PoseStream

_MOST = 240
"""Samples used: more of a correlated stream say nothing new."""
PHONE_SD = np.array([np.radians(0.1)] * 3 + [0.002] * 3)
"""Of an ARKit pose from one moment to the next, rad and m, before the data itself is asked."""
TARGET_SD = np.array([np.radians(0.3)] * 3 + [0.003] * 3)
"""Of a pose of a tracker that does not tell."""


@dataclass(frozen=True)
class Samples:
    """Simultaneous poses of phone and target, in pairs."""

    times: Float64[np.ndarray, " n"]
    """On the target's clock, seconds."""
    T_world_phone: Float64[np.ndarray, "n 4 4"]
    T_camera_target: Float64[np.ndarray, "n 4 4"]
    target_covariance: Float64[np.ndarray, "n 6 6"]
    velocity: Float64[np.ndarray, "n 6"]
    """Of the phone in its world: rad/s, m/s."""

    def later(self, phone: PoseStream, seconds: float) -> "Samples":
        """The samples with the phone's poses of `seconds` after the target's times."""
        at = self.times + seconds
        return replace(self, T_world_phone=phone.at(at), velocity=phone.velocity(at))


def paired(phone: PoseStream, target: PoseStream, offset: float) -> Samples:
    """Samples evenly over the time in which both streams are known; at most a few hundred.

    They are taken where the stream that has fewer poses has one: between those it is a guess.
    """
    if np.median(np.diff(phone.times)) > np.median(np.diff(target.times)):
        times = phone.times - offset
        both = np.flatnonzero(target.known(times))
    else:
        times = target.times
        both = np.flatnonzero(phone.known(times + offset))
    if len(both) > _MOST:
        both = both[np.linspace(0, len(both) - 1, _MOST).round().astype(int)]
    times = times[both]
    nearest = np.abs(target.times[:, None] - times).argmin(axis=0)
    return Samples(
        times,
        phone.at(times + offset),
        target.at(times),
        _covariances(target)[nearest],
        phone.velocity(times + offset),
    )


def matched(phone: PoseStream, target: PoseStream) -> Samples:
    """Samples of streams whose poses belong together one by one, whatever their times."""
    still = np.zeros((len(target.times), 6))
    return Samples(target.times, phone.T, target.T, _covariances(target), still)


def _covariances(target: PoseStream) -> Float64[np.ndarray, "poses 6 6"]:
    if target.covariance is not None:
        return target.covariance
    return np.tile(np.diag(TARGET_SD**2), (len(target.times), 1, 1))
