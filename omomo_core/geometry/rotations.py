"""Rotations in torch: 6D and yaw, heading of a person, the canonical frame, and xyzw quaternions.

6D rotations and yaw, for torch tensors of any batch shape. Quaternions are xyzw (see roma).

Features are vectors first, scalars after. The origin is a moving reference that every window of a
take shares, so between windows only the heading differs, and that is a linear map: x0 estimates of
overlapping windows can be averaged exactly.
"""

from dataclasses import dataclass

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation
from torch import Tensor

from omomo_core.geometry.geometry_config import HEADING


def rotmat_to_6d(R: Float[Tensor, "*batch 3 3"]) -> Float[Tensor, "*batch 2 3"]:
    """The first two columns of R, as two vectors (Zhou et al. 2019).

    Kept as vectors and not as six numbers: a change of world frame turns them like any direction.
    """
    return R[..., :, :2].transpose(-1, -2)


def rotmat_from_6d(six: Float[Tensor, "*batch 2 3"]) -> Float[Tensor, "*batch 3 3"]:
    """Inverse of `rotmat_to_6d` by Gram-Schmidt; accepts unnormalised vectors."""
    return roma.special_gramschmidt(six.transpose(-1, -2))


def yaw_matrix(yaw: Float[Tensor, "*batch"]) -> Float[Tensor, "*batch 3 3"]:
    """Rotation by `yaw` radians about world z (counter-clockwise seen from above)."""
    zero, one = torch.zeros_like(yaw), torch.ones_like(yaw)
    c, s = torch.cos(yaw), torch.sin(yaw)
    rows = [c, -s, zero, s, c, zero, zero, zero, one]
    return torch.stack(rows, dim=-1).reshape(*yaw.shape, 3, 3)


def human_frame(
    root: Float[Tensor, "b 3"], R_world_root: Float[Tensor, "b 3 3"]
) -> tuple[Float[Tensor, "b 3"], Float[Tensor, " b"]]:
    """Origin (floor point under the pelvis, metres) and yaw (radians) of each window's frame.

    In that frame the person's left axis, laid on the floor, is +x: the person faces -y
    (facts of the published release; the paper's section 4 only says "canonicalised").
    """
    origin = root.clone()
    origin[:, 2] = 0
    left = R_world_root[:, :, 0]
    return origin, torch.atan2(left[:, 1], left[:, 0])


def into_frame(
    points: Float[Tensor, "b frames *n 3"], origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames *n 3"]:
    """World points in the frames."""
    flat = points.flatten(1, -2) - origin[:, None]
    return torch.einsum("bij,bnj->bni", yaw_matrix(-yaw).to(points.dtype), flat).view_as(points)


def out_of_frame(
    points: Float[Tensor, "b frames *n 3"], origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames *n 3"]:
    """Inverse of `into_frame`."""
    flat = torch.einsum("bij,bnj->bni", yaw_matrix(yaw).to(points.dtype), points.flatten(1, -2))
    return (flat + origin[:, None]).view_as(points)


@dataclass(frozen=True)
class Layout:
    """How many 3-vectors a feature row begins with, and how many scalars follow."""

    vectors: int
    scalars: int

    @property
    def channels(self) -> int:
        """Length of a row."""
        return 3 * self.vectors + self.scalars


def turn(
    x: Float[Tensor, "b frames channels"], yaw: Float[Tensor, " b"], layout: Layout
) -> Float[Tensor, "b frames channels"]:
    """Turn the vectors of each row by its window's yaw (radians, about z); scalars stay."""
    return rotate(x, yaw_matrix(yaw)[:, None], layout)


def rotate(
    x: Float[Tensor, "b frames channels"], R: Float[Tensor, " b #frames 3 3"], layout: Layout
) -> Float[Tensor, "b frames channels"]:
    """Turn the vectors of each row by a rotation of its window, or of its frame; scalars stay."""
    split = 3 * layout.vectors
    vectors = x[..., :split].unflatten(-1, (layout.vectors, 3))
    turned = vectors @ R.to(x.dtype).transpose(-1, -2)
    return torch.cat([turned.flatten(-2), x[..., split:]], dim=-1)


def heading_of_travel(
    centre: Float[Tensor, "b frames 3"], valid: Bool[Tensor, "b frames"]
) -> tuple[Float[Tensor, " b"], Bool[Tensor, " b"]]:
    """Yaw of the way from an object's first to its last place; False where it hardly goes."""
    last = valid.long().sum(dim=1).clamp(min=1) - 1
    way = centre[torch.arange(len(centre)), last, :2] - centre[:, 0, :2]
    return torch.atan2(way[:, 1], way[:, 0]), way.norm(dim=-1) > HEADING.shortest_travel


def heading_of_palms(
    palms: Float[Tensor, "b frames 2 3"], valid: Bool[Tensor, "b frames"]
) -> Float[Tensor, " b"]:
    """Yaw that the person faces, from the mean direction between right and left palm."""
    left = ((palms[:, :, 0] - palms[:, :, 1])[..., :2] * valid[..., None]).sum(dim=1)
    return torch.atan2(-left[:, 0], left[:, 1])


ROUNDING = 1e-6
"""What single precision may change in a quaternion that is read and written again."""


def xyzw_from_matrix(
    R: Float[np.ndarray, "frames *batch 3 3"],
    before: Float[np.ndarray, "*batch 4"] | None = None,
) -> Float[np.ndarray, "frames *batch 4"]:
    """Unit quaternions of rotations over time, continuous along the frames.

    q and -q are the same rotation: the first frame takes w >= 0 and every later one the sign nearer
    to the frame before, so that a reader may interpolate the numbers.

    Args:
        R: rotations of consecutive frames.
        before: quaternions of the frame before them, if there is one.
    """
    # Matrices that are rounded to single precision need not be made orthogonal first, which takes long.
    quaternions = roma.rotmat_to_unitquat(torch.from_numpy(R.astype(np.float64))).numpy()
    near = quaternions[:1, ..., 3:]
    if before is not None:
        near = np.sum(quaternions[:1] * before, axis=-1, keepdims=True)
    quaternions[:1] *= np.where(near < 0, -1.0, 1.0)
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
