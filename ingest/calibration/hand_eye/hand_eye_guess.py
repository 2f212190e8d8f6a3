"""The clocks' offset by correlation, and a first mount by closed form.

A X = X B for relative motions A of the phone and B of the target. Rotations by matching rotation
vectors (Park and Martin 1994), found by consensus; then translations, linear.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.calibration.hand_eye.hand_eye_model import PoseStream, Samples
from ingest.smoothing import cross_correlation
from ingest.uncertainty import rotation, rotation_vector
from omomo_core.geometry.transforms import inverse, nearest_rotation

_PAIRS_DRAWN, _PAIRS = 3000, 300
_LONGEST = 12.0
"""Seconds between the poses of a pair: over longer ones ARKit drifts."""
_WIDEST = np.radians(160)
"""Near half a turn, the axis of a rotation vector may point either way."""
_TRIES = 150
_TRUNCATE = 0.15
"""Radians beyond which one rotation vector is as wrong as another."""
_ONE_AXIS = np.radians(3.0)
"""Mean turn across the main axis below which the matching about that axis is swept instead."""
_RIDGE = 1e-4
"""Holds a translation that no rotation shows near zero."""


class Motions(NamedTuple):
    """Relative motions of the phone and of the target over the same stretches of time."""

    A: Float64[np.ndarray, "pairs 4 4"]
    B: Float64[np.ndarray, "pairs 4 4"]


def motions(samples: Samples, rng: np.random.Generator) -> Motions:
    """The pairs of samples that turned most, of those whose two turns are about equally large."""
    n = len(samples.times)
    i, j = rng.integers(0, n, (2, _PAIRS_DRAWN))
    near = (i != j) & (np.abs(samples.times[i] - samples.times[j]) < _LONGEST)
    i, j = i[near], j[near]
    A = inverse(samples.T_world_phone[i]) @ samples.T_world_phone[j]
    B = inverse(samples.T_camera_target[i]) @ samples.T_camera_target[j]
    turn_a, turn_b = (Rotation.from_matrix(M[:, :3, :3]).magnitude() for M in (A, B))
    off = np.abs(turn_a - turn_b)
    alike = off <= max(np.radians(1.5), 4 * float(np.quantile(off, 0.3)))
    usable = np.flatnonzero(alike & (turn_a < _WIDEST) & (turn_b < _WIDEST))
    usable = usable[np.argsort(-turn_a[usable])[:_PAIRS]]
    return Motions(A[usable], B[usable])


def first_guess(moved: Motions, rng: np.random.Generator) -> Float64[np.ndarray, "4 4"]:
    """The mount that most of the motions agree with."""
    a, b = (rotation_vector(M[:, :3, :3]) for M in moved)
    R = _consensus(a, b, rng)
    axis = np.linalg.svd(a, full_matrices=False)[2][0]
    across = a - np.outer(a @ axis, axis)
    turns = [R]
    if np.sqrt((across**2).sum(axis=1).mean()) < _ONE_AXIS:
        angles = np.arange(0, 2 * np.pi, np.pi / 18)
        turns = list(rotation(np.outer(angles, axis)) @ R)
    found = [(turn, *_translation(moved, turn)) for turn in turns]
    best, t, _ = min(found, key=lambda guess: guess[2])
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = best, t
    return X


def _consensus(
    a: Float64[np.ndarray, "pairs 3"], b: Float64[np.ndarray, "pairs 3"], rng: np.random.Generator
) -> Float64[np.ndarray, "3 3"]:
    """The R with a = R b for most of the pairs."""
    chosen = rng.integers(0, len(a), (_TRIES, 2))
    candidates = _matching(a[chosen], b[chosen])
    off = np.linalg.norm(a[None] - np.einsum("cij,pj->cpi", candidates, b), axis=-1)
    best = int(np.argmin(np.minimum(off, _TRUNCATE).mean(axis=1)))
    turn = candidates[best]
    for _ in range(3):
        off = np.linalg.norm(a - b @ turn.T, axis=1)
        good = off <= max(3 * float(np.median(off)), 1e-9)
        turn = _matching(a[None, good], b[None, good])[0]
    return turn


def _matching(
    a: Float64[np.ndarray, "sets pairs 3"], b: Float64[np.ndarray, "sets pairs 3"]
) -> Float64[np.ndarray, "sets 3 3"]:
    """The R of least squares with a = R b (Kabsch), for each set."""
    return nearest_rotation(np.einsum("spi,spj->sij", a, b))


def _translation(
    moved: Motions, R: Float64[np.ndarray, "3 3"]
) -> tuple[Float64[np.ndarray, "3"], float]:
    """t of (R_A - 1) t = R t_B - t_A without the worst, and the median of what is left over."""
    M = moved.A[:, :3, :3] - np.eye(3)
    c = moved.B[:, :3, 3] @ R.T - moved.A[:, :3, 3]
    good = np.ones(len(M), bool)
    t, off = np.zeros(3), np.zeros(len(M))
    for _ in range(5):
        square = np.einsum("pki,pkj->ij", M[good], M[good]) + _RIDGE * good.sum() * np.eye(3)
        t = np.linalg.solve(square, np.einsum("pki,pk->i", M[good], c[good]))
        off = np.linalg.norm(M @ t - c, axis=1)
        good = off <= 2 * np.median(off)
    return t, float(np.median(off))


RATE = 100.0
_WINDOW = 0.15
"""Seconds on each side over which a turn is measured: stamps err by 10 ms, poses by a degree."""
_CANDIDATES, _APART = 3, 40
"""Offsets that are proposed, and how many samples they are apart at least."""
_NEIGHBOURS = 4
_SLACK = np.radians(3.0)
"""Angle by which two good poses' rotations may err, radians."""
_LEAST_OVERLAP = 0.4
"""Part of the shorter stream that must lie within the other."""


class Offset(NamedTuple):
    """What to add to the second stream's times to get the first one's."""

    seconds: float
    correlation: float
    """Correlation of the turning speeds at this offset: 0.95 and more when the two belong together."""


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
    overlap = cross_correlation

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
    """Return the lag at which the parabola through the best lag and its neighbours is highest."""
    if not 0 < best < len(score) - 1:
        return 0.0
    left, middle, right = score[best - 1 : best + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0
