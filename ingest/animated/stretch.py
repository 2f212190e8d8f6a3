"""Transforms with a scale become rigid poses and one stretch of the mesh."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float64

from omomo_core.errors import InputError
from omomo_core.geometry.transforms import nearest_rotation

_TOLERANCE = 1e-3
_FLAT = 1e-6


def split_stretch(
    T: Float64[np.ndarray, "frames 4 4"], place: Callable[[int], str]
) -> tuple[Float64[np.ndarray, "frames 4 4"], Float64[np.ndarray, "3 3"]]:
    """Rigid poses, and the stretch S of the mesh, such that T @ v = pose @ (S @ v).

    S is what scale (even or not), shear and mirror of a node and its parents amount to; it is the
    same in every frame, or the object is not rigid.

    Args:
        T: affine transforms, last row 0 0 0 1.
        place: says where a frame is, for messages.

    Raises:
        InputError: "animation-not-affine", "animation-flat" when a scale is zero,
            "animation-stretched" when size or shape change.
    """
    odd = np.abs(T[:, 3] - [0, 0, 0, 1]).max(axis=1) > _TOLERANCE
    if odd.any():
        raise InputError(
            "animation-not-affine",
            "The last row of the matrix is not 0 0 0 1.",
            where=place(int(np.argmax(odd))),
            fix="Write matrices row by row, the position in the last column.",
        )
    first = T[0, :3, :3]
    _, sizes, axes = np.linalg.svd(first)
    if sizes[2] <= _FLAT * max(sizes[0], _FLAT):
        raise InputError(
            "animation-flat",
            "The object is scaled to nothing.",
            where=place(0),
            fix="Give the object and its parents a scale that is not zero.",
        )
    stretch = (axes.T * sizes) @ axes * np.sign(np.linalg.det(first))
    R = T[:, :3, :3] @ np.linalg.inv(stretch)
    off = np.abs(R.swapaxes(1, 2) @ R - np.eye(3)).max(axis=(1, 2)) > _TOLERANCE
    if off.any():
        raise InputError(
            "animation-stretched",
            "The object changes its size or shape; people move rigid things.",
            where=place(int(np.argmax(off))),
            fix="Take out keys of scale, and apply uneven scale of its parents (in Blender Ctrl+A, "
            "Scale).",
        )
    poses = T.copy()
    poses[:, :3, :3] = nearest_rotation(R)
    poses[:, 3] = [0, 0, 0, 1]
    return poses, stretch
