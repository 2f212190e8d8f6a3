"""Rigid transforms and time derivatives, for numpy arrays."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation


def apply(T_a_b: Float[np.ndarray, "frames 4 4"], points_b: Float[np.ndarray, "points 3"]):
    """Points of frame b in frame a, for each frame: (frames, points, 3)."""
    return points_b @ T_a_b[:, :3, :3].swapaxes(-1, -2) + T_a_b[:, None, :3, 3]


def to_local(
    T_a_b: Float[np.ndarray, "frames 4 4"], points_a: Float[np.ndarray, "frames points 3"]
) -> Float[np.ndarray, "frames points 3"]:
    """Points of frame a in frame b, for each frame."""
    return (points_a - T_a_b[:, None, :3, 3]) @ T_a_b[:, :3, :3]


def inverse(T_a_b: Float[np.ndarray, "*batch 4 4"]) -> Float[np.ndarray, "*batch 4 4"]:
    """T_b_a of a rigid T_a_b."""
    T_b_a = np.zeros_like(T_a_b)
    R_b_a = T_a_b[..., :3, :3].swapaxes(-1, -2)
    T_b_a[..., :3, :3] = R_b_a
    T_b_a[..., :3, 3] = -np.einsum("...ij,...j->...i", R_b_a, T_a_b[..., :3, 3])
    T_b_a[..., 3, 3] = 1.0
    return T_b_a


def velocity(
    x: Float[np.ndarray, " frames *rest"], fps: float
) -> Float[np.ndarray, " frames *rest"]:
    """Central differences, one-sided at the ends, in units per second; zero for a single frame."""
    return np.gradient(x, axis=0) * fps if len(x) > 1 else np.zeros_like(x)


def turning_speed(
    R_a_b: Float[np.ndarray, "frames *joints 3 3"], fps: float
) -> Float[np.ndarray, " frames *joints"]:
    """How fast rotations turn from each frame to the next, rad/s; 0 in the last frame."""
    turns = np.swapaxes(R_a_b[:-1], -1, -2) @ R_a_b[1:]
    cosine = (np.trace(turns, axis1=-2, axis2=-1) - 1) / 2
    speed = np.arccos(cosine.clip(-1.0, 1.0)) * fps
    return np.concatenate([speed, np.zeros_like(R_a_b[:1, ..., 0, 0])])


def angular_velocity(
    R_world_body: Float[np.ndarray, "frames 3 3"], fps: float
) -> Float[np.ndarray, "frames 3"]:
    """Angular velocity in the world, rad/s: that from each frame to the next, the last repeated."""
    if len(R_world_body) < 2:
        return np.zeros((len(R_world_body), 3))
    step = R_world_body[1:] @ R_world_body[:-1].swapaxes(-1, -2)
    omega = Rotation.from_matrix(step).as_rotvec() * fps
    return np.concatenate([omega, omega[-1:]])
