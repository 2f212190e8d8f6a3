"""Rotation matrices to and from xyzw quaternions, for numpy arrays of any batch shape."""

import numpy as np
import roma
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation

ROUNDING = 1e-6
"""What single precision may change in a quaternion that is read and written again."""


def xyzw_from_matrix(
    R: Float[np.ndarray, "frames *batch 3 3"],
) -> Float[np.ndarray, "frames *batch 4"]:
    """Unit quaternions of rotations over time, continuous along the frames.

    q and -q are the same rotation: the first frame takes w >= 0 and every later one the sign nearer
    to the frame before, so that a reader may interpolate the numbers.
    """
    # Matrices that are rounded to single precision need not be made orthogonal first, which takes long.
    quaternions = roma.rotmat_to_unitquat(torch.from_numpy(R.astype(np.float64))).numpy()
    quaternions[:1] *= np.where(quaternions[:1, ..., 3:] < 0, -1.0, 1.0)
    turns = np.sum(quaternions[1:] * quaternions[:-1], axis=-1, keepdims=True) < 0
    quaternions[1:] *= np.cumprod(np.where(turns, -1.0, 1.0), axis=0)
    return quaternions


def matrix_from_xyzw(q: Float[np.ndarray, "*batch 4"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation matrices of quaternions, which are normalised first."""
    flat = Rotation.from_quat(q.reshape(-1, 4).astype(np.float64)).as_matrix()
    return flat.reshape(*q.shape[:-1], 3, 3)


def same_numbers(
    q: Float[np.ndarray, "frames *batch 4"], earlier: Float[np.ndarray, "frames *batch 4"]
) -> Float[np.ndarray, "frames *batch 4"]:
    """Quaternions with the earlier ones' numbers wherever they are the same rotation but for rounding.

    The signs stay those of `q`.
    """
    signed = np.copysign(1.0, np.sum(q * earlier, axis=-1, keepdims=True)) * earlier
    same = np.abs(signed - q).max(axis=-1, keepdims=True) < ROUNDING
    return np.where(same, signed, q)
