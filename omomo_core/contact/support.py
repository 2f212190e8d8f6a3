"""When an object must be held: nothing here moves, floats or leans by itself."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import binary_opening, uniform_filter1d

from omomo_core.generation.take import Take

MOVES, TURNS = 0.10, 0.5
"""m/s of the centre and rad/s above which an object does not move by itself."""
STILL, LEVEL = 0.02, 0.1
"""m/s and rad/s below which it may rest on something: a held object trembles."""
RESTS = 15
"""Frames that it has to be still to count as resting."""
REACH = 0.03
"""Metres from the floor to its lowest point within which the floor carries it."""
SOLE = 0.02
"""Metres: what is no higher than this above its lowest point may touch the floor."""
OVERHANG = 0.03
"""Metres that its centre may be beside what touches the floor."""
SHORTEST = 6
"""Frames: what lasts less is noise of the tracker."""
_TILT = 0.01
"""Radians between two tilts that are told apart."""
_OUTLINE, _AROUND = 256, 32
"""Directions in which the object's outline and its support are felt for."""


def must_be_held(take: Take) -> Bool[np.ndarray, " frames"]:
    """Frames in which somebody holds the object.

    Where it moves or turns; where it is off the floor and not still (still, it may stand on a table);
    and where it is on the floor but tipped, so that it would fall. Each frame is judged by the 20
    around it.
    """
    speed, spin = (np.linalg.norm(x, axis=1) for x in (take.velocity, take.spin))
    low = take.lowest < REACH
    held = (speed > MOVES) | (spin > TURNS) | (~low & ~_still(take))
    unsure = np.flatnonzero(low & ~held)
    held[unsure] = _tipped(take, unsure)
    return _lasting(held, SHORTEST)


def _still(take: Take) -> Bool[np.ndarray, " frames"]:
    """Frames in which the object may be resting."""
    speed, spin = (
        np.linalg.norm(uniform_filter1d(x, 5, axis=0, mode="nearest"), axis=1)
        for x in (take.velocity, take.spin)
    )
    return _lasting((speed < STILL) & (spin < LEVEL), RESTS)


def _lasting(x: Bool[np.ndarray, " frames"], shortest: int) -> Bool[np.ndarray, " frames"]:
    """Only the runs of at least so many frames, and those that the take's ends cut short."""
    whole = np.pad(x, shortest, mode="edge")
    return binary_opening(whole, np.ones(shortest))[shortest:-shortest]


def _tipped(take: Take, frames: Int[np.ndarray, " some"]) -> Bool[np.ndarray, " some"]:
    """Whether the object would fall over; that depends on nothing but which side of it is down."""
    up = take.motion.T_world_object[frames, 2, :3]
    tilts, which = np.unique(np.round(up / _TILT), axis=0, return_inverse=True)
    corners, centre = take.surface.outline, take.surface.centre
    directions = np.random.default_rng(0).normal(size=(_OUTLINE, 3))
    outline = corners[np.unique((corners @ directions.T).argmax(axis=0))]
    falls = [_overhang(outline, centre, t / np.linalg.norm(t)) > OVERHANG for t in tilts]
    return np.array(falls, bool)[which.reshape(-1)]


def _overhang(
    outline: Float[np.ndarray, "points 3"],
    centre: Float[np.ndarray, "3"],
    up: Float[np.ndarray, "3"],
) -> float:
    """Metres that the centre is beside what touches the floor, negative where it is above it.

    Args:
        outline: corners of the object's convex hull, its frame, metres.
        centre: its centre of mass.
        up: the world's up in its frame.
    """
    height = outline @ up
    height -= height.min()
    low, high = height <= SOLE, height > SOLE
    # Where the hull's sides leave the sole: without them support would depend on the tessellation.
    share = (SOLE - height[low])[:, None] / (height[high] - height[low][:, None])
    rim = outline[low][:, None] + share[..., None] * (outline[high] - outline[low][:, None])
    touching = np.concatenate([outline[low], rim.reshape(-1, 3)])
    angle = np.arange(_AROUND) * (2 * np.pi / _AROUND)
    across = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    across /= np.linalg.norm(across)
    around = np.outer(np.cos(angle), across) + np.outer(np.sin(angle), np.cross(up, across))
    return float((around @ centre - (around @ touching.T).max(axis=1)).max())
