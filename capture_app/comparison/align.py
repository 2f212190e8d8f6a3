"""Putting a motion onto the clock and into the world of another one, by the object both move."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from omomo_core.motion import FPS, ObjectMesh, ObjectMotion
from render.third_person import object_corners

_SAME_SIZE = 0.05
"""Share by which the sides of one object's boxes may differ between two meshes of it."""
_SAME_PATH = 0.05
"""Metres (RMS over the box's corners) within which two paths of the object are the same."""
_UNMOVED = 0.01
"""Metres within which two worlds are the same already."""
_COMMON = 0.8
"""Least share of the shorter motion that both have in common."""


@dataclass(frozen=True)
class Placement:
    """Where another motion belongs."""

    begin: int
    """Frame of the first motion at which it begins; may be negative."""
    T: Float[np.ndarray, "4 4"]
    """Takes its world to the first one's: a turn about the vertical and a shift along the floor."""
    apart: float
    """RMS distance of the object's corners after that, metres."""
    same_take: bool
    """The object takes the same way in both."""


def same_object(a: ObjectMesh, b: ObjectMesh) -> bool:
    """Whether two meshes are as large along their sides, sorted by length."""
    sides = [np.sort(np.ptp(mesh.vertices, axis=0)) for mesh in (a, b)]
    return bool(np.allclose(*sides, rtol=_SAME_SIZE, atol=0.005))


def place(first: ObjectMotion, other: ObjectMotion) -> Placement:
    """Where `other` fits `first` best.

    The clock is shifted to where the heights of the object's corners and its speed along the floor
    agree best: neither depends on where the axes of a world point. Then the world is turned about
    the vertical and shifted. Objects that go different ways begin together at one place instead.
    """
    a, b = object_corners(first), object_corners(other)
    expected = round((other.start_time - first.start_time) * FPS)
    begin = _lag(_features(a), _features(b), expected)
    ours, theirs = _common(a, b, begin)
    apart = _rms(ours - theirs)
    if apart < _UNMOVED:
        return Placement(begin, np.eye(4), apart, same_take=True)
    fitted = _planar(ours, theirs)
    apart = _rms(theirs @ fitted[:3, :3].T + fitted[:3, 3] - ours)
    if apart < _SAME_PATH:
        return Placement(begin, fitted, apart, same_take=True)
    together = np.eye(4)
    together[:2, 3] = (a[0] - b[0])[:, :2].mean(axis=0)
    return Placement(0, together, apart, same_take=False)


def _features(corners: Float[np.ndarray, "frames 8 3"]) -> Float[np.ndarray, "frames 9"]:
    """Heights, and metres along the floor in a tenth of a second."""
    middle = corners.mean(axis=1)[:, :2]
    step = np.gradient(middle, axis=0) if len(middle) > 1 else np.zeros_like(middle)
    speed = np.linalg.norm(step, axis=1, keepdims=True) * FPS / 10
    return np.concatenate([corners[..., 2], speed], axis=1)


def _lag(
    ours: Float[np.ndarray, "frames_a 9"], theirs: Float[np.ndarray, "frames_b 9"], expected: int
) -> int:
    """Frames that the other motion begins later, as expected where others are no better."""
    n, m = len(ours), len(theirs)
    least = max(1, int(np.ceil(_COMMON * min(n, m))))
    lags = np.arange(least - m, n - least + 1)
    cost = [np.abs(np.subtract(*_common(ours, theirs, int(lag)))).mean() for lag in lags]
    return int(lags[np.argmin(np.array(cost) + 1e-6 * np.abs(lags - expected))])


def _common(a: np.ndarray, b: np.ndarray, begin: int) -> tuple[np.ndarray, np.ndarray]:
    """The frames of both while both last; b begins at a's frame `begin`."""
    start, stop = max(0, begin), min(len(a), begin + len(b))
    return a[start:stop], b[start - begin : stop - begin]


def _planar(
    ours: Float[np.ndarray, "frames 8 3"], theirs: Float[np.ndarray, "frames 8 3"]
) -> Float[np.ndarray, "4 4"]:
    """The turn about the vertical and the shift along the floor of least squares."""
    p, q = theirs.reshape(-1, 3)[:, :2], ours.reshape(-1, 3)[:, :2]
    pc, qc = p - p.mean(axis=0), q - q.mean(axis=0)
    yaw = np.arctan2((pc[:, 0] * qc[:, 1] - pc[:, 1] * qc[:, 0]).sum(), (pc * qc).sum())
    c, s = np.cos(yaw), np.sin(yaw)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:2, 3] = q.mean(axis=0) - T[:2, :2] @ p.mean(axis=0)
    return T


def _rms(difference: Float[np.ndarray, "frames 8 3"]) -> float:
    return float(np.sqrt((difference**2).sum(axis=-1).mean()))
