"""When an object must be held: it moves, is off the floor, or would tip over."""

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import binary_opening, uniform_filter1d

from omomo_core.contact.config import STABILITY, SUPPORT
from omomo_core.contact.static_stability import overhang
from omomo_core.geometry.object_features import ObjectFeatures


def must_be_held(take: ObjectFeatures) -> Bool[np.ndarray, " frames"]:
    """Return the frames in which somebody must hold the object.

    It must be held where it moves or turns, where it is off the floor and not still (a still one may stand on
    a table), and where it is on the floor but tipped, so that it would fall.
    """
    speed, spin = (np.linalg.norm(x, axis=1) for x in (take.velocity, take.spin))
    low = take.lowest < STABILITY.floor_reach
    held = (speed > SUPPORT.moving_speed) | (spin > SUPPORT.turning_speed) | (~low & ~_still(take))
    unsure = np.flatnonzero(low & ~held)
    held[unsure] = overhang(take, unsure).metres > STABILITY.stable_overhang
    return _drop_short_runs(held, SUPPORT.shortest_run)


def touchable_range(
    take: ObjectFeatures, must_hold: Bool[np.ndarray, " frames"]
) -> tuple[int, int]:
    """Return the first frame, and the one after the last, in which hands may be on the object.

    Args:
        take: the object and its motion.
        must_hold: frames in which somebody must hold it.

    Returns:
        A moment before it is first moved and as long after it was last; (frames, 0) if it never moves.
        What is lifted or tipped must be gripped first; what slides flat moves as soon as it is touched.
    """
    moved = np.flatnonzero(must_hold | _drop_short_runs(~_still(take), SUPPORT.rest_frames))
    if not len(moved):
        return take.frames, 0
    rises, frames = (
        (SUPPORT.flat_rise, SUPPORT.lifted_rise),
        (SUPPORT.touching, SUPPORT.gripping),
    )
    rise = max(float(np.ptp(take.centre[:, 2])), float(take.lowest.max()))
    around = round(float(np.interp(rise, rises, frames)))
    return max(int(moved[0]) - around, 0), min(int(moved[-1]) + 1 + around, take.frames)


def _still(take: ObjectFeatures) -> Bool[np.ndarray, " frames"]:
    """Return the frames in which the object may be resting."""
    speed, spin = (
        np.linalg.norm(uniform_filter1d(x, SUPPORT.smoothing, axis=0, mode="nearest"), axis=1)
        for x in (take.velocity, take.spin)
    )
    return _drop_short_runs(
        (speed < SUPPORT.resting_speed) & (spin < SUPPORT.resting_turning_speed),
        SUPPORT.rest_frames,
    )


def _drop_short_runs(x: Bool[np.ndarray, " frames"], shortest: int) -> Bool[np.ndarray, " frames"]:
    """Return only the runs of at least so many frames, and those that the take's ends cut short."""
    whole = np.pad(x, shortest, mode="edge")
    return binary_opening(whole, np.ones(shortest))[shortest:-shortest]
