"""PoseStream: poses over time, and their interpolation."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.uncertainty import rotation, rotation_vector

MAX_GAP = 0.25
"""Seconds between two poses over which nothing is made up."""
_SPAN = 0.05
"""Seconds on each side over which velocities are taken; some logs stamp in steps of 10 ms."""


@dataclass(frozen=True)
class PoseStream:
    """Poses of one thing in one frame, metres."""

    times: Float64[np.ndarray, " poses"]
    """Seconds on the stream's own clock, strictly increasing."""
    T: Float64[np.ndarray, "poses 4 4"]
    covariance: Float64[np.ndarray, "poses 6 6"] | None = None
    """Of each pose, as in `ingest.uncertainty`; None when the tracker does not tell."""

    def at(self, times: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, "n 4 4"]:
        """Poses between those of the stream: turned evenly, moved evenly; held at its ends."""
        inside = np.clip(times, self.times[0], self.times[-1])
        after = np.searchsorted(self.times, inside).clip(1, len(self.times) - 1)
        start, end = self.times[after - 1], self.times[after]
        part = ((inside - start) / (end - start))[:, None]
        before, behind = self.T[after - 1], self.T[after]
        turn = rotation_vector(before[:, :3, :3].swapaxes(-1, -2) @ behind[:, :3, :3])
        T = np.tile(np.eye(4), (len(times), 1, 1))
        T[:, :3, :3] = before[:, :3, :3] @ rotation(part * turn)
        T[:, :3, 3] = (1 - part) * before[:, :3, 3] + part * behind[:, :3, 3]
        return T

    def velocity(self, times: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, "n 6"]:
        """Angular velocity (rad/s) and velocity of the origin (m/s) in the outer frame's axes."""
        before, after = self.at(times - _SPAN), self.at(times + _SPAN)
        turn = rotation_vector(after[:, :3, :3] @ before[:, :3, :3].swapaxes(-1, -2))
        return np.concatenate([turn, after[:, :3, 3] - before[:, :3, 3]], axis=1) / (2 * _SPAN)

    def known(self, times: Float64[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
        """Whether a time lies within the stream and not in a gap of it."""
        after = np.searchsorted(self.times, times).clip(1, len(self.times) - 1)
        gap = self.times[after] - self.times[after - 1]
        return (times >= self.times[0]) & (times <= self.times[-1]) & (gap <= MAX_GAP)
