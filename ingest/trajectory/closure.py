"""Closure: how far the tracker drifted over a take that ends where it began."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.trajectory.rests import find_rests
from ingest.trajectory.trajectory_config import CLOSURE
from omomo_core.errors import InputError
from omomo_core.motion import FPS


@dataclass(frozen=True)
class Closure:
    """The difference between an object's rest at the start of a take and at its end."""

    translation: float
    """Metres between the two places; drift if both are the same mark."""
    rotation: float
    """Degrees between the two attitudes."""
    seconds: float
    """From the first rest to the last."""
    path: float
    """Metres that the object travelled in between."""
    first: tuple[int, int]
    """(start, stop) of the rest at the start, frames at 30 fps."""
    last: tuple[int, int]
    """The same at the end."""


def find_closure(
    T: Float64[np.ndarray, "frames 4 4"], usable: Bool[np.ndarray, " frames"]
) -> Closure | None:
    """Compare the object's rest in the first five seconds with that in the last five.

    Args:
        T: the object in a world of constant axes, at 30 fps.
        usable: which frames are tracked.

    Returns:
        None when it does not rest, at different times, at both ends.
    """
    rests = find_rests(T, usable)
    tracked = np.flatnonzero(usable)
    if len(rests) < 2:
        return None
    first, last = rests[0], rests[-1]
    if max(first[0] - tracked[0], tracked[-1] + 1 - last[1]) > CLOSURE.near_end * FPS:
        return None
    start, end = _mean(T, first), _mean(T, last)
    turn = Rotation.from_matrix(start[:3, :3].T @ end[:3, :3]).magnitude()
    return Closure(
        translation=float(np.linalg.norm(end[:3, 3] - start[:3, 3])),
        rotation=float(np.degrees(turn)),
        seconds=(last[0] - first[1]) / FPS,
        path=float(_steps(T, first[1] - 1, last[0]).sum()),
        first=first,
        last=last,
    )


def spread(
    T_zup_object: Float64[np.ndarray, "frames 4 4"], closure: Closure | None, where: str
) -> Float64[np.ndarray, "frames 4 4"]:
    """Take the drift out: the last rest comes to the place and heading of the first.

    The error in place and in heading (about z; gravity keeps the rest) grows with the path
    travelled, and each step of the path is turned by the heading's error up to there.

    Raises:
        InputError: "closure-no-rests", or "closure-elsewhere" when the two rests are too far apart
            to be the same mark.
    """
    closure = _checked(closure, where)
    (_, leave), (arrive, _) = closure.first, closure.last
    start, end = _mean(T_zup_object, closure.first), _mean(T_zup_object, closure.last)
    progress = np.zeros(len(T_zup_object))
    steps = _steps(T_zup_object, leave - 1, arrive)
    progress[leave : arrive + 1] = np.cumsum(steps) / steps.sum()
    progress[arrive:] = 1.0
    turns = Rotation.from_rotvec(np.outer(progress, [0, 0, -_heading(start, end)])).as_matrix()
    out = T_zup_object.copy()
    out[:, :3, :3] = turns @ T_zup_object[:, :3, :3]
    moved = np.einsum("nij,nj->ni", turns[1:], np.diff(T_zup_object[:, :3, 3], axis=0))
    out[1:, :3, 3] = T_zup_object[0, :3, 3] + np.cumsum(moved, axis=0)
    left = _mean(out, closure.first)[:3, 3] - _mean(out, closure.last)[:3, 3]
    out[:, :3, 3] += progress[:, None] * left
    return out


def _checked(closure: Closure | None, where: str) -> Closure:
    if closure is None:
        raise InputError(
            "closure-no-rests",
            "Drift can only be taken out of a take that begins and ends with the object at rest.",
            where=where,
            fix="Rest the object on its mark for a second at the start and at the end, or leave out "
            "‹closure›.",
        )
    allowed = CLOSURE.largest_shift + CLOSURE.largest_share * closure.path
    if closure.translation > allowed or closure.rotation > CLOSURE.largest_turn:
        raise InputError(
            "closure-elsewhere",
            f"The object ends {closure.translation:.2f} m and {closure.rotation:.0f} deg from where "
            f"it began: after {closure.path:.1f} m that is no drift.",
            where=where,
            fix="Bring the object back to its mark, turned as it was, or leave out ‹closure›.",
        )
    return closure


def _mean(
    T: Float64[np.ndarray, "frames 4 4"], frames: tuple[int, int]
) -> Float64[np.ndarray, "4 4"]:
    """Return the mean pose of the middle half of a rest: at its borders the object already moves."""
    start, stop = frames
    chosen = T[start + (stop - start) // 4 : stop - (stop - start) // 4]
    out = np.eye(4)
    out[:3, :3] = Rotation.from_matrix(chosen[:, :3, :3]).mean().as_matrix()
    out[:3, 3] = chosen[:, :3, 3].mean(axis=0)
    return out


def _steps(
    T: Float64[np.ndarray, "frames 4 4"], first: int, last: int
) -> Float64[np.ndarray, " steps"]:
    """Length of each step from frame `first` to frame `last`."""
    return np.linalg.norm(np.diff(T[first : last + 1, :3, 3], axis=0), axis=1) + CLOSURE.least_step


def _heading(start: Float64[np.ndarray, "4 4"], end: Float64[np.ndarray, "4 4"]) -> float:
    """Rotation about z from start to end, rad, that leaves the least between them."""
    R = end[:3, :3] @ start[:3, :3].T
    return float(np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1]))
