"""The offset between two clocks, from how fast the same thing turns on each."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64
from scipy.signal import correlate
from scipy.spatial.transform import Rotation

from ingest.calibration.hand_eye.streams import PoseStream

RATE = 100.0
_WINDOW = 0.15
"""Seconds on each side over which a turn is measured: stamps err by 10 ms, poses by a degree."""
_CANDIDATES, _APART = 3, 40
"""Offsets that are proposed, and how many samples they are apart at least."""
_NEIGHBOURS = 4
_SLACK = np.radians(3.0)
"""By how much two good poses' rotations may err."""
_LEAST_OVERLAP = 0.4
"""Part of the shorter stream that must lie within the other."""


class Offset(NamedTuple):
    """What to add to the second stream's times to get the first one's."""

    seconds: float
    correlation: float
    """Of the turning speeds at this offset: 0.95 and more when the two belong together."""


def find_offsets(phone: PoseStream, target: PoseStream) -> list[Offset]:
    """Slide one stream along the other: the offsets at which they turn most alike, the best first.

    Poses of the target that could only be reached by turning faster than the phone ever does are left
    out first.
    """
    speed = turning(phone)
    good = _believable(target, 1.3 * float(np.nanmax(speed, initial=0)))
    other = turning(good)
    score, count = _masked_correlation(speed, other)
    # Fisher: the more samples overlap, the less a correlation is chance.
    rank = np.arctanh(score.clip(-0.999, 0.999)) * np.sqrt(count)
    found: list[Offset] = []
    for _ in range(_CANDIDATES):
        best = int(np.argmax(rank))
        lag = (best - (len(other) - 1) + peak(score, best)) / RATE
        found.append(Offset(float(phone.times[0] + lag - good.times[0]), float(score[best])))
        rank[max(0, best - _APART) : best + _APART] = -np.inf
    return found


def turning(stream: PoseStream) -> Float64[np.ndarray, " samples"]:
    """Turning speed, rad/s, at RATE from the stream's first time; NaN where it is not known."""
    times = np.arange(stream.times[0], stream.times[-1], 1 / RATE)
    before, after = (stream.at(times + side)[:, :3, :3] for side in (-_WINDOW, _WINDOW))
    angle = Rotation.from_matrix(after @ before.swapaxes(-1, -2)).magnitude()
    known = stream.known(times - _WINDOW) & stream.known(times + _WINDOW)
    return np.where(known, angle / (2 * _WINDOW), np.nan)


def _believable(stream: PoseStream, fastest: float) -> PoseStream:
    """The poses that most of their neighbours can be reached from at `fastest` rad/s."""
    R = Rotation.from_matrix(stream.T[:, :3, :3])
    votes, asked = np.zeros(len(R)), np.zeros(len(R))
    for lag in range(1, _NEIGHBOURS + 1):
        angle = (R[:-lag].inv() * R[lag:]).magnitude()
        near = angle < fastest * (stream.times[lag:] - stream.times[:-lag]) + _SLACK
        for side in (slice(None, -lag), slice(lag, None)):
            votes[side] += near
            asked[side] += 1
    good = votes > 0.5 * asked
    if good.sum() < 2:
        return stream
    return PoseStream(stream.times[good], stream.T[good])


def _masked_correlation(
    a: Float64[np.ndarray, " m"], b: Float64[np.ndarray, " n"]
) -> tuple[Float64[np.ndarray, " lags"], Float64[np.ndarray, " lags"]]:
    """Pearson's correlation at every lag over the samples known in both, and how many those are."""
    known_a, known_b = np.isfinite(a).astype(float), np.isfinite(b).astype(float)
    a, b = np.nan_to_num(a), np.nan_to_num(b)

    def overlap(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return correlate(x, y, method="fft")

    count = overlap(known_a, known_b)
    enough = count > _LEAST_OVERLAP * min(known_a.sum(), known_b.sum())
    count = np.maximum(count, 1)
    mean_a, mean_b = overlap(a, known_b) / count, overlap(known_a, b) / count
    var_a = overlap(a**2, known_b) / count - mean_a**2
    var_b = overlap(known_a, b**2) / count - mean_b**2
    shared = overlap(a, b) / count - mean_a * mean_b
    # A stretch that hardly turns correlates with anything.
    least = 0.05 * max(float(var_a[enough].max(initial=0)), 1e-12)
    score = shared / np.sqrt(np.maximum(var_a * var_b, least**2))
    return np.where(enough, score, -1.0), count


def peak(score: Float64[np.ndarray, " lags"], best: int) -> float:
    """Where between the lags the parabola through the best and its neighbours is highest."""
    if not 0 < best < len(score) - 1:
        return 0.0
    left, middle, right = score[best - 1 : best + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0
