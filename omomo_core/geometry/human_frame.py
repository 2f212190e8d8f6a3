"""The paper's canonical frame: where the person stands and faces in a window's first frame."""

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.geometry.rotations import yaw_matrix


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
