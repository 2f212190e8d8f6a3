"""When an object must be held: it moves, is off the floor, or would tip over."""

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import binary_opening, uniform_filter1d

from omomo_core.contact.static_stability import OVERHANG, REACH, overhang
from omomo_core.geometry.object_features import ObjectFeatures

MOVES, TURNS = 0.10, 0.5
"""m/s of the centre and rad/s above which an object does not move by itself."""
STILL, LEVEL = 0.02, 0.1
"""m/s and rad/s below which it may rest on something; a held object trembles more."""
RESTS = 15
"""Frames for which it has to be still to count as resting, or to move slowly to count as moved."""
SHORTEST = 6
"""Runs of fewer frames are noise of the tracker."""
REACHING = 30
"""Frames that hands may be on an object before it is first moved, and after it was last: people take hold at
most a second before."""


def must_be_held(take: ObjectFeatures) -> Bool[np.ndarray, " frames"]:
    """Return the frames in which somebody must hold the object.

    It must be held where it moves or turns, where it is off the floor and not still (a still one may stand on
    a table), and where it is on the floor but tipped, so that it would fall.
    """
    speed, spin = (np.linalg.norm(x, axis=1) for x in (take.velocity, take.spin))
    low = take.lowest < REACH
    held = (speed > MOVES) | (spin > TURNS) | (~low & ~_still(take))
    unsure = np.flatnonzero(low & ~held)
    held[unsure] = overhang(take, unsure).metres > OVERHANG
    return _drop_short_runs(held, SHORTEST)


def touchable_range(
    take: ObjectFeatures, must_hold: Bool[np.ndarray, " frames"]
) -> tuple[int, int]:
    """Return the first frame, and the one after the last, in which hands may be on the object.

    Args:
        take: the object and its motion.
        must_hold: frames in which somebody must hold it.

    Returns:
        One second before it is first moved and one second after it was last; (frames, 0) if it never moves.
    """
    moved = np.flatnonzero(must_hold | _drop_short_runs(~_still(take), RESTS))
    if not len(moved):
        return take.frames, 0
    return max(int(moved[0]) - REACHING, 0), min(int(moved[-1]) + 1 + REACHING, take.frames)


def _still(take: ObjectFeatures) -> Bool[np.ndarray, " frames"]:
    """Return the frames in which the object may be resting."""
    speed, spin = (
        np.linalg.norm(uniform_filter1d(x, 5, axis=0, mode="nearest"), axis=1)
        for x in (take.velocity, take.spin)
    )
    return _drop_short_runs((speed < STILL) & (spin < LEVEL), RESTS)


def _drop_short_runs(x: Bool[np.ndarray, " frames"], shortest: int) -> Bool[np.ndarray, " frames"]:
    """Return only the runs of at least so many frames, and those that the take's ends cut short."""
    whole = np.pad(x, shortest, mode="edge")
    return binary_opening(whole, np.ones(shortest))[shortest:-shortest]
