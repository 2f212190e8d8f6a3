"""The shortest way from one direction to another."""

import numpy as np
from jaxtyping import Float


def shortest_turn(
    old: Float[np.ndarray, "3"], new: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3 3"]:
    """The smallest rotation R with R old along new; about any axis across them where they oppose.

    Exact for every pair of directions: the common closed form loses all digits near half a turn, and so
    does scipy's `Rotation.align_vectors` some.

    Args:
        old, new: of any length but zero, in the same frame.
    """
    old, new = (np.asarray(v, np.float64) / np.linalg.norm(v) for v in (old, new))
    if old @ new < 0:
        # Half a turn about the axis of the whole, then the rest the other way.
        axis = _across(old, new)
        return shortest_turn(-old, new) @ (2 * np.outer(axis, axis) - np.eye(3))
    x, y, z = np.cross(old, new)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + K + K @ K / (1 + old @ new)


def _across(old: Float[np.ndarray, "3"], new: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """A unit vector square to the unit vector `old`, and to `new` unless they oppose."""
    axis = np.cross(old, new)
    if np.linalg.norm(axis) < 1e-9:
        axis = np.cross(old, np.eye(3)[np.abs(old).argmin()])
    axis = axis / np.linalg.norm(axis)
    axis = axis - (axis @ old) * old
    return axis / np.linalg.norm(axis)
