"""Whether a palm has room where it is to lie, and a forearm a way to it."""

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.learning.synthesis.props.rays import RayMesh

_HAND_THICKNESS = 0.04
_HAND_REACH = 0.035
"""From the palm sideways: half a hand, metres."""
_FOREARM = 0.22
"""Of the forearm, what has to be free, metres."""
_ELBOW_BEHIND = 0.12


def free(
    mesh: RayMesh, points: Float[np.ndarray, "n 2 3"], inward: Float[np.ndarray, "n 2 3"]
) -> Bool[np.ndarray, " n"]:
    """Which pairs of palms (left, right) have room for hands and forearms."""
    out = -inward
    one = np.cross(out, np.where(np.abs(out[..., 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    two = np.cross(out, one)
    back = points + out * _HAND_THICKNESS
    towards = _elbows(mesh, points, inward) - back
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    middle = points + out * 0.025
    checks = [(points + out * 0.004, out, _HAND_THICKNESS), (back, towards, _FOREARM)]
    checks += [(middle, d, _HAND_REACH) for d in (one, -one, two, -two)]
    origins = np.stack([c[0] for c in checks])
    hits = mesh.cast(
        origins.reshape(-1, 3), np.stack([c[1] for c in checks]).reshape(-1, 3)
    ).distance.reshape(origins.shape[:-1])
    room = np.array([c[2] for c in checks])[:, None, None]
    above_floor = back[..., 2] > 0.0
    return np.all((hits > room).all(axis=0) & above_floor, axis=1)


def _elbows(
    mesh: RayMesh, points: Float[np.ndarray, "n 2 3"], inward: Float[np.ndarray, "n 2 3"]
) -> Float[np.ndarray, "n 2 3"]:
    """Where the elbows of somebody at -x would be: behind, outside; above low hands."""
    x, y, z = np.moveaxis(points, -1, 0)
    side = np.array([1.0, -1.0])
    rise = ((1.0 - z) * 0.35).clip(-0.2, 0.3)
    # Palms that carry from below have their forearms below the edge.
    rise = np.where(inward[..., 2] > 0.7, np.minimum(rise, -0.06), rise)
    behind = np.minimum(mesh.low[0], x - 0.1) - _ELBOW_BEHIND
    return np.stack([behind, y * 1.1 + side * 0.1, z + rise], axis=-1)
