"""What a pose stream would be if it were read another way: how wrong files are told apart."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from omomo_core.geometry.transforms import inverse

Poses = Float64[np.ndarray, "poses 4 4"]


@dataclass(frozen=True)
class OtherReading:
    """A way in which a file of poses is often wrong."""

    fault: str
    fix: str
    read: Callable[[Poses], Poses]


def _order(T: Poses, order: list[int]) -> Poses:
    """The rotations if the numbers of their quaternions stood in another order."""
    out = T.copy()
    quaternion = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    out[:, :3, :3] = Rotation.from_quat(quaternion[:, order]).as_matrix()
    return out


def _turned_back(T: Poses) -> Poses:
    out = T.copy()
    out[:, :3, :3] = T[:, :3, :3].swapaxes(-1, -2)
    return out


def _mirrored(T: Poses) -> Poses:
    flip = np.diag([1.0, 1.0, -1.0, 1.0])
    return flip @ T @ flip


READINGS = (
    OtherReading(
        "is inverted",
        "Its poses must map the moving thing's points into the resting frame; invert each.",
        inverse,
    ),
    OtherReading(
        "has quaternions with w first, read as if x were first",
        "Write quaternions as x, y, z, w.",
        lambda T: _order(T, [1, 2, 3, 0]),
    ),
    OtherReading(
        "has quaternions with x first, read as if w were first",
        "Write quaternions as x, y, z, w.",
        lambda T: _order(T, [3, 0, 1, 2]),
    ),
    OtherReading(
        "has its rotations inverted but not its positions",
        "Give both of the moving thing in the resting frame.",
        _turned_back,
    ),
    OtherReading(
        "is mirrored (left-handed)",
        "Turn the left-handed axes of its program (Unity, Unreal) into right-handed ones.",
        _mirrored,
    ),
)
