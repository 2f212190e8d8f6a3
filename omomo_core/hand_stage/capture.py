"""Stage 1 of the `capture` configuration: palms relative to the object, and contact per hand."""

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.capture import stage_config
from omomo_core.geometry.canonical import Layout, heading_of_travel, turn
from omomo_core.windows import ObjectWindows

LAYOUT = Layout(vectors=2, scalars=2)
"""Left and right palm minus the object's centre; contact of left and right hand as -1 or 1."""
CONDITION = 10

CONFIG = stage_config("hands", LAYOUT.channels, CONDITION)


def canonical_yaw(windows: ObjectWindows) -> Float[Tensor, " b"]:
    """Heading of travel, or 0 where the object goes nowhere (any heading is as good)."""
    yaw, travels = heading_of_travel(windows.centre, windows.valid)
    return torch.where(travels, yaw, torch.zeros_like(yaw))


def training_yaw(windows: ObjectWindows) -> Float[Tensor, " b"]:
    """The canonical heading, disturbed; uniform for objects that stay and a quarter of the rest."""
    yaw, travels = heading_of_travel(windows.centre, windows.valid)
    keep = travels & (torch.rand(len(yaw)) < 0.75)
    return torch.where(keep, yaw + 0.4 * torch.randn(len(yaw)), 2 * torch.pi * torch.rand(len(yaw)))


def condition(
    windows: ObjectWindows, yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames condition"]:
    """Velocity, spin, place relative to the window's mean, and height of centre and lowest point."""
    count = windows.valid.sum(dim=1).clamp(min=1)[:, None, None]
    mean = (windows.centre * windows.valid[..., None]).sum(dim=1, keepdim=True) / count
    place = windows.centre - mean
    vectors = torch.cat([windows.velocity, windows.spin, place], dim=-1)
    turned = turn(vectors, -yaw, Layout(3, 0))
    heights = torch.stack([windows.centre[..., 2], windows.lowest], dim=-1)
    return torch.cat([turned[..., :8], heights], dim=-1)


def pack(
    palms: Float[Tensor, "b frames 2 3"],
    contact: Float[Tensor, "b frames 2"],
    windows: ObjectWindows,
) -> Float[Tensor, "b frames channels"]:
    """Features in world axes (turn them by -yaw for the network); contact in [0, 1]."""
    relative = palms - windows.centre[:, :, None]
    return torch.cat([relative.flatten(-2), 2 * contact - 1], dim=-1)


def unpack(
    x: Float[Tensor, "*b channels"], centre: Float[Tensor, "*b 3"]
) -> tuple[Float[Tensor, "*b 2 3"], Float[Tensor, "*b 2"]]:
    """Palms (world, metres) and contact in [0, 1] from features in world axes."""
    palms = x[..., :6].unflatten(-1, (2, 3)) + centre[..., None, :]
    return palms, ((x[..., 6:] + 1) / 2).clamp(0, 1)
