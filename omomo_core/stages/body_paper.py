"""Stage 2 as published (OMOMO section 3.4): 204 numbers per frame, conditioned on the palms alone."""

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.geometry.rotations import into_frame, out_of_frame, yaw_matrix
from omomo_core.stages.stage import StageConfig
from omomo_core.stages.stage_config import Size, paper_stage_config

POSITIONS = 72
CHANNELS = POSITIONS + 132

PALMS = slice(POSITIONS - 6, POSITIONS)
"""Channels of the palms (joints 22 and 23)."""


def config(size: Size) -> StageConfig:
    """Palms in, body out."""
    return paper_stage_config("body", size, channels=CHANNELS, condition=CHANNELS)


CONFIG = config("published")


def pack(
    joints: Float[Tensor, "b frames 24 3"],
    rotations: Float[Tensor, "b frames 22 3 3"],
    origin: Float[Tensor, "b 3"],
    yaw: Float[Tensor, " b"],
) -> Float[Tensor, "b frames 204"]:
    """24 joint positions in the frame, then the first two ROWS of each of 22 global rotations."""
    turned = yaw_matrix(-yaw)[:, None, None].to(rotations.dtype) @ rotations
    positions = into_frame(joints, origin, yaw).flatten(-2)
    return torch.cat([positions, turned[..., :2, :].flatten(-3)], dim=-1)


def unpack(
    x: Float[Tensor, "b frames 204"], origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> tuple[Float[Tensor, "b frames 24 3"], Float[Tensor, "b frames 22 3 3"]]:
    """Joints and global rotations in the world; rotations are made orthonormal."""
    joints = out_of_frame(x[..., :POSITIONS].unflatten(-1, (24, 3)), origin, yaw)
    R_frame_joint = from_rows(x[..., POSITIONS:])
    return joints, yaw_matrix(yaw)[:, None, None].to(x.dtype) @ R_frame_joint


def from_rows(rows: Float[Tensor, "*b 132"]) -> Float[Tensor, "*b 22 3 3"]:
    """Rotations from their first two rows, made orthonormal."""
    rows = rows.unflatten(-1, (22, 2, 3))
    first = torch.nn.functional.normalize(rows[..., 0, :], dim=-1)
    second = rows[..., 1, :] - (first * rows[..., 1, :]).sum(-1, keepdim=True) * first
    second = torch.nn.functional.normalize(second, dim=-1)
    third = torch.linalg.cross(first, second)
    return torch.stack([first, second, third], dim=-2)


def condition(
    palms_normalised: Float[Tensor, "b frames 6"], generator: torch.Generator | None = None
) -> Float[Tensor, "b frames 204"]:
    """The palms in their own slots (joints 22, 23) and fresh standard noise everywhere else."""
    shape = (*palms_normalised.shape[:2], CHANNELS)
    noise = torch.randn(shape, generator=generator, dtype=palms_normalised.dtype)
    noise[..., PALMS] = palms_normalised
    return noise
