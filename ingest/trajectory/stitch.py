"""Stitching: the part of a log after a tracking jump is moved back to where it belongs."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.session import CaptureSession
from ingest.trajectory.breaks import Breaks
from ingest.trajectory.config import JUMPS
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import inverse


@dataclass(frozen=True)
class Stitch:
    """A jump that was taken out."""

    step: int
    """From pose `step` to the next."""
    metres: float
    radians: float


def stitch_jumps(
    session: CaptureSession, breaks: Breaks
) -> tuple[CaptureSession, Breaks, list[Stitch]]:
    """Move everything after each single-step jump so that the velocity continues through it.

    ARKit corrects itself by one rigid transform of everything that follows, so the motion within
    the later part is right. The step that the phone really made is the mean of its velocity in the
    five steps before and after, in its own axes, which the correction leaves alone. Jumps of
    several steps, or beside another break, stay.

    Returns:
        The session with its poses moved, the breaks that remain, and the jumps taken out.
    """
    T = session.T_world_phone.copy()
    jumps = breaks.jumps.copy()
    found: list[Stitch] = []
    for first, last in runs(breaks.any):
        if last - first > 1 or not jumps[first]:
            continue
        T_phone_next = _true_step(session.times, session.T_world_phone, breaks.any, first)
        if T_phone_next is None:
            continue
        correction = T[first] @ T_phone_next @ inverse(T[first + 1])
        metres = np.linalg.norm((correction @ T[first + 1] - T[first + 1])[:3, 3])
        turn = Rotation.from_matrix(correction[:3, :3]).magnitude()
        T[first + 1 :] = correction @ T[first + 1 :]
        jumps[first] = False
        found.append(Stitch(first, float(metres), float(turn)))
    return replace(session, T_world_phone=T), replace(breaks, jumps=jumps), found


def _true_step(
    times: Float64[np.ndarray, " frames"],
    T: Float64[np.ndarray, "frames 4 4"],
    broken: Bool[np.ndarray, " steps"],
    step: int,
) -> Float64[np.ndarray, "4 4"] | None:
    """The motion of the phone in a step, in its own axes; None when too few steps around tell."""
    sides = (
        np.arange(step - 1, step - 1 - JUMPS.stitch_window, -1),
        np.arange(step + 1, step + 1 + JUMPS.stitch_window),
    )
    rates: list[Float64[np.ndarray, " twist"]] = []
    for side in sides:
        inside = side[(side >= 0) & (side < len(broken))]
        clean = inside[np.cumsum(broken[inside]) == 0]
        if len(clean) < JUMPS.fewest_stitch_steps:
            return None
        moved = inverse(T[clean]) @ T[clean + 1]
        turned = Rotation.from_matrix(moved[:, :3, :3]).as_rotvec()
        seconds = times[clean + 1] - times[clean]
        rates.append(np.concatenate([turned, moved[:, :3, 3]], axis=1).sum(0) / seconds.sum())
    out = np.eye(4)
    both = (rates[0] + rates[1]) / 2 * (times[step + 1] - times[step])
    out[:3, :3] = Rotation.from_rotvec(both[:3]).as_matrix()
    out[:3, 3] = both[3:]
    return out
