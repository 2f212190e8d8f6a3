"""Stage 2 of the `capture` configuration: the body relative to its own root, any distance walked."""

import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.geometry.rotations import Layout, heading_of_palms, turn
from omomo_core.stages.stage import HumanWindows, ObjectWindows
from omomo_core.stages.stage_config import BODY_STAGE, capture_stage_config

LAYOUT = Layout(vectors=1 + 23 + 44, scalars=4)
"""Root from the reference point; 21 joints and 2 palms from the root; two columns of each of the 22
global rotations; four foot contacts as -1 or 1."""
CONDITION = 18

CONFIG = capture_stage_config("body", LAYOUT.channels, CONDITION)


def reference_path(palms: Float[Tensor, "*b frames 2 3"]) -> Float[Tensor, "*b frames 2"]:
    """The floor point under the palms' midpoint, smoothed in time: what the body is measured from."""
    middle = palms.mean(dim=-2)[..., :2]
    smooth = gaussian_filter1d(
        middle.numpy(), BODY_STAGE.reference_smoothing, axis=-2, mode="nearest"
    )
    return torch.from_numpy(smooth).to(palms.dtype)


def canonical_yaw(
    palms: Float[Tensor, "b frames 2 3"], windows: ObjectWindows
) -> Float[Tensor, " b"]:
    """Heading of the person by the palms."""
    return heading_of_palms(palms, windows.valid)


def training_yaw(
    palms: Float[Tensor, "b frames 2 3"], windows: ObjectWindows
) -> Float[Tensor, " b"]:
    """The canonical heading, disturbed; uniform for one window in eight."""
    yaw = heading_of_palms(palms, windows.valid)
    near = torch.rand(len(yaw)) < 0.875
    disturbed = yaw + 0.25 * torch.randn(len(yaw))
    return torch.where(near, disturbed, 2 * torch.pi * torch.rand(len(yaw)))


def condition(
    palms: Float[Tensor, "b frames 2 3"],
    hand_contact: Float[Tensor, "b frames 2"],
    reference: Float[Tensor, "b frames 2"],
    upright: Float[Tensor, " b"],
    windows: ObjectWindows,
    yaw: Float[Tensor, " b"],
) -> Float[Tensor, "b frames condition"]:
    """Palms and object from the reference point, the reference's own path, contacts, heights, habit."""
    floor = torch.cat([reference, torch.zeros_like(reference[..., :1])], dim=-1)
    there = windows.present[:, None, None].to(palms.dtype)
    count = windows.valid.sum(dim=1).clamp(min=1)[:, None, None]
    mean = (floor * windows.valid[..., None]).sum(dim=1, keepdim=True) / count
    pace = torch.gradient(floor, dim=1)[0]
    vectors = torch.cat(
        [
            (palms - floor[:, :, None]).flatten(-2),
            (windows.centre - floor) * there,
            floor - mean,
            pace,
        ],
        dim=-1,
    )
    turned = turn(vectors, -yaw, Layout(5, 0))
    alike = [windows.lowest[..., None] * there, there, (2 * upright - 1)[:, None, None]]
    scalars = [hand_contact, *(x.expand(*palms.shape[:2], 1) for x in alike)]
    # Heights of the two floor paths are always zero: left out.
    return torch.cat([turned[..., :11], turned[..., 12:14], *scalars], dim=-1)


def pack(human: HumanWindows) -> Float[Tensor, "b frames channels"]:
    """Features in world axes (turn them by -yaw for the network)."""
    root = human.joints[:, :, :1]
    floor = torch.cat([human.reference, torch.zeros_like(human.reference[..., :1])], dim=-1)
    vectors = torch.cat(
        [root - floor[:, :, None], human.joints[:, :, 1:] - root, human.rotations_6d.flatten(2, 3)],
        dim=2,
    )
    return torch.cat([vectors.flatten(-2), 2 * human.foot_contact - 1], dim=-1)


def unpack(
    x: Float[Tensor, "*b channels"], reference: Float[Tensor, "*b 2"]
) -> tuple[
    Float[Tensor, "*b 3"],
    Float[Tensor, "*b 24 3"],
    Float[Tensor, "*b 22 2 3"],
    Float[Tensor, "*b 4"],
]:
    """Root, joints (world, metres), rotation columns, foot contact in [0, 1] from world features."""
    vectors = x[..., : 3 * LAYOUT.vectors].unflatten(-1, (LAYOUT.vectors, 3))
    floor = torch.cat([reference, torch.zeros_like(reference[..., :1])], dim=-1)
    root = vectors[..., 0, :] + floor
    joints = torch.cat([root[..., None, :], root[..., None, :] + vectors[..., 1:24, :]], dim=-2)
    six = vectors[..., 24:, :].unflatten(-2, (22, 2))
    contact = ((x[..., 3 * LAYOUT.vectors :] + 1) / 2).clamp(0, 1)
    return root, joints, six, contact


def feet(x: Float[Tensor, "*b channels"]) -> Float[Tensor, "*b 12"]:
    """Left ankle, right ankle, left toe, right toe from the reference point, metres."""
    vectors = x[..., : 3 * 24].unflatten(-1, (24, 3))
    return (vectors[..., :1, :] + vectors[..., (7, 8, 10, 11), :]).flatten(-2)
