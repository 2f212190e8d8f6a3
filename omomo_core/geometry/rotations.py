"""6D rotations and yaw, for torch tensors of any batch shape. Quaternions are xyzw (see roma)."""

import roma
import torch
from jaxtyping import Float
from torch import Tensor


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
