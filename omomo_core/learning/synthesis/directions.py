"""Level directions from a yaw angle about world z."""

import numpy as np
from jaxtyping import Float


def ahead_of(yaw: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b 2"]:
    """Unit vectors in x and y along a heading, radians."""
    return np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)


def left_of(yaw: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b 2"]:
    """Unit vectors in x and y to the left of a heading, radians."""
    return np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1)


def about_z(yaw: Float[np.ndarray, "*b"]) -> Float[np.ndarray, "*b 3 3"]:
    """Rotations by a yaw, radians."""
    c, s, o = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    return np.stack([c, -s, o, s, c, o, o, o, o + 1.0], axis=-1).reshape(*np.shape(yaw), 3, 3)


def in_space(xy: Float[np.ndarray, "*b 2"]) -> Float[np.ndarray, "*b 3"]:
    """Level vectors, with z 0."""
    return np.concatenate([xy, np.zeros((*xy.shape[:-1], 1))], axis=-1)


def turned_by(
    yaw: Float[np.ndarray, "*#b"], xy: Float[np.ndarray, "*#b 2"]
) -> Float[np.ndarray, "*b 2"]:
    """Points of the plane turned about the origin by a yaw, radians."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = xy[..., 0], xy[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)
