"""Frames that need no human: a heading per window, and what a change of heading does to features.

Features are vectors first, scalars after. The origin is a moving reference that every window of a
take shares, so between windows only the heading differs, and that is a linear map: x0 estimates of
overlapping windows can be averaged exactly.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.geometry.config import HEADING
from omomo_core.geometry.rotations import yaw_matrix


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
