"""Stage 1 of the `capture` configuration: palms relative to the object, and contact per hand.

The network sees and predicts everything in axes that are fixed to the object and canonical in the middle of
the window: there a palm that holds the object stands still, however the object turns.
"""

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.diffusion.samplers import golden_sequence
from omomo_core.geometry.rotations import (
    Layout,
    heading_of_travel,
    rotate,
    rotmat_to_6d,
    turn,
    yaw_matrix,
)
from omomo_core.stages.stage import ObjectWindows
from omomo_core.stages.stage_config import HAND_STAGE, capture_stage_config

LAYOUT = Layout(vectors=2, scalars=2)
"""Left and right palm minus the object's centre; contact of left and right hand as -1 or 1."""
CONDITION = 25
UNKNOWN_START = torch.zeros(3)
"""The start of a window where nobody knows it."""

CONFIG = capture_stage_config("hands", LAYOUT.channels, CONDITION)


def canonical_yaw(windows: ObjectWindows) -> Float[Tensor, " b"]:
    """Heading of travel, or 0 where the object goes nowhere (any heading is as good)."""
    yaw, travels = heading_of_travel(windows.centre, windows.valid)
    return torch.where(travels, yaw, torch.zeros_like(yaw))


def training_yaw(windows: ObjectWindows) -> Float[Tensor, " b"]:
    """The canonical heading, disturbed; uniform where the object stays, and now and then."""
    yaw, travels = heading_of_travel(windows.centre, windows.valid)
    keep = travels & (torch.rand(len(yaw)) > 1 / HAND_STAGE.uniform_every)
    disturbed = yaw + HAND_STAGE.heading_spread * torch.randn(len(yaw))
    return torch.where(keep, disturbed, 2 * torch.pi * torch.rand(len(yaw)))


def sampling_yaw(windows: ObjectWindows, samples: int) -> Float[Tensor, " b"]:
    """Return headings distributed as in training, spread evenly over any number of samples.

    Args:
        windows: of all samples, those of one sample after another.
        samples: how many samples.
    """
    yaw, travels = heading_of_travel(windows.centre, windows.valid)
    every = HAND_STAGE.uniform_every
    turn = torch.arange(samples).repeat_interleave(len(yaw) // samples)
    keep = travels & (turn % every < every - 1)
    near = HAND_STAGE.heading_spread * torch.special.ndtri(golden_sequence(turn))
    around = 2 * torch.pi * golden_sequence(torch.where(travels, turn // every, turn))
    return torch.where(keep, yaw + near, around)


def object_axes(windows: ObjectWindows, yaw: Float[Tensor, " b"]) -> Float[Tensor, "b frames 3 3"]:
    """R_world_axes: fixed to the object, equal to the canonical ones in the window's middle frame."""
    middle = windows.valid.sum(dim=1).clamp(min=1) // 2
    R_world_middle = windows.R_world_object[torch.arange(len(middle)), middle]
    R_object_axes = R_world_middle.transpose(-1, -2) @ yaw_matrix(yaw).to(R_world_middle)
    return windows.R_world_object @ R_object_axes[:, None]


def shape_code(
    windows: ObjectWindows, axes: Float[Tensor, "b frames 3 3"]
) -> Float[Tensor, "b 1 shape"]:
    """BPS of the object in those axes: the same in every frame."""
    R_axes_object = axes[:, :1].transpose(-1, -2) @ windows.R_world_object[:, :1]
    return windows.shape(R_axes_object).flatten(-2) * windows.present[:, None, None]


def condition(
    windows: ObjectWindows,
    yaw: Float[Tensor, " b"],
    axes: Float[Tensor, "b frames 3 3"],
    start: Float[Tensor, "b 3"],
) -> Float[Tensor, "b frames condition"]:
    """Velocity, spin, place from the window's mean, and heights; how the object has turned; the start.

    In canonical axes; velocity and spin in the object's too.

    Args:
        windows: the object.
        yaw: heading of the canonical axes.
        axes: of `object_axes`.
        start: x and y from the object's centre to the pelvis in the window's first frame (world axes,
            metres), and 1; `UNKNOWN_START` where that is not known.
    """
    count = windows.valid.sum(dim=1).clamp(min=1)[:, None, None]
    mean = (windows.centre * windows.valid[..., None]).sum(dim=1, keepdim=True) / count
    place = windows.centre - mean
    vectors = torch.cat([windows.velocity, windows.spin, place], dim=-1)
    turned = turn(vectors, -yaw, Layout(3, 0))
    heights = torch.stack([windows.centre[..., 2], windows.lowest], dim=-1)
    moved = torch.cat([windows.velocity, windows.spin], dim=-1)
    seen = rotate(moved, axes.transpose(-1, -2), Layout(2, 0))
    R_canonical_axes = yaw_matrix(-yaw).to(axes)[:, None] @ axes
    six = rotmat_to_6d(R_canonical_axes).flatten(-2)
    begin = turn(start[:, None], -yaw, Layout(1, 0)).expand(-1, heights.shape[1], -1)
    return torch.cat([turned[..., :8], heights, seen, six, begin], dim=-1)


def pack(
    palms: Float[Tensor, "b frames 2 3"],
    contact: Float[Tensor, "b frames 2"],
    windows: ObjectWindows,
) -> Float[Tensor, "b frames channels"]:
    """Features in world axes (rotate them into `object_axes` for the network); contact in [0, 1]."""
    relative = palms - windows.centre[:, :, None]
    return torch.cat([relative.flatten(-2), 2 * contact - 1], dim=-1)


def unpack(
    x: Float[Tensor, "*b channels"], centre: Float[Tensor, "*b 3"]
) -> tuple[Float[Tensor, "*b 2 3"], Float[Tensor, "*b 2"]]:
    """Palms (world, metres) and contact in [0, 1] from features in world axes."""
    palms = x[..., :6].unflatten(-1, (2, 3)) + centre[..., None, :]
    return palms, ((x[..., 6:] + 1) / 2).clamp(0, 1)
