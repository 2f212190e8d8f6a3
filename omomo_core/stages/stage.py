"""A stage: one network with its windows, from features to samples."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from omomo_core.diffusion.denoiser import Denoiser, DenoiserConfig
from omomo_core.geometry.object_features import ObjectFeatures, encode
from omomo_core.stages.network_file import load_network

Configuration = Literal["capture", "paper"]
StageName = Literal["hands", "body", "single"]


@dataclass(frozen=True)
class StageConfig:
    """Which stage, in which configuration, of which size."""

    stage: StageName
    configuration: Configuration
    denoiser: DenoiserConfig
    clamp: bool = False
    """Clip x0 to [-1, 1] while sampling, as the paper does."""
    level_shift: float = 1.0
    """How far the levels that are trained and sampled lean to much noise (`shifted`)."""


class Stage(nn.Module):
    """Predicts x0 of raw features (metres, not normalised) from raw conditions."""

    def __init__(self, config: StageConfig) -> None:
        super().__init__()
        self.config = config
        self.denoiser = Denoiser(config.denoiser)
        for name, width in (("x", config.denoiser.channels), ("c", config.denoiser.condition)):
            self.register_buffer(f"{name}_mean", torch.zeros(width))
            self.register_buffer(f"{name}_std", torch.ones(width))
        self.x_mean: Tensor
        self.x_std: Tensor
        self.c_mean: Tensor
        self.c_std: Tensor

    def normalise(self, x: Float[Tensor, "*b channels"]) -> Float[Tensor, "*b channels"]:
        """Raw features to the scale the diffusion works in."""
        return (x - self.x_mean) / self.x_std

    def denormalise(self, x: Float[Tensor, "*b channels"]) -> Float[Tensor, "*b channels"]:
        """Inverse of `normalise`."""
        return x * self.x_std + self.x_mean

    def forward(
        self,
        x: Float[Tensor, "b frames channels"],
        condition: Float[Tensor, "b frames condition"],
        shape: Float[Tensor, " b #tokens shape"] | None,
        level: Tensor,
        valid: Bool[Tensor, "b frames"],
    ) -> Float[Tensor, "b frames channels"]:
        """x0 (normalised) from x_n (normalised) and a raw condition, as precise and where x is.

        The denoiser may be on another device than its statistics and the arguments.
        """
        weight = self.denoiser.out.weight
        normalised = ((condition - self.c_mean) / self.c_std).to(weight)
        code = None if shape is None else shape.to(weight)
        level, valid = level.to(weight.device), valid.to(weight.device)
        x0 = self.denoiser(x.to(weight), normalised, code, level, valid).to(x)
        return x0.clamp(-1, 1) if self.config.clamp and not self.training else x0


@dataclass(frozen=True)
class Stages:
    """The two trained networks."""

    hands: Stage
    body: Stage
    height: float
    """Stature of the body they were trained on, metres."""


def load_stage(path: Path) -> Stage:
    """Read a stage that `save_network` wrote, in evaluation mode.

    Raises:
        AssetError: missing, damaged, or not one of our files.
    """
    return load_network(path, _stage)


def _stage(config: dict[str, Any]) -> Stage:
    sizes = DenoiserConfig(**config.pop("denoiser"))
    return Stage(StageConfig(**config, denoiser=sizes))


WINDOW = 120
"""Frames in a window: 4 s at 30 fps, as in the paper."""
STRIDE = WINDOW // 2

ShapeLookup = Callable[[Float[Tensor, "b tokens 3 3"]], Float[Tensor, "b tokens points 3"]]
"""R_canonical_object of some frames -> BPS vectors of each window's object, canonical axes."""


@dataclass(frozen=True)
class ObjectWindows:
    """The object in a batch of windows; world frame, metres, seconds, radians."""

    centre: Float[Tensor, "b frames 3"]
    """Mean of the surface."""
    lowest: Float[Tensor, "b frames"]
    """Height of the lowest point."""
    velocity: Float[Tensor, "b frames 3"]
    spin: Float[Tensor, "b frames 3"]
    """Angular velocity."""
    R_world_object: Float[Tensor, "b frames 3 3"]
    shape: ShapeLookup
    present: Bool[Tensor, " b"]
    """False for training clips without an object."""
    valid: Bool[Tensor, "b frames"]
    """False on padding."""


@dataclass(frozen=True)
class HumanWindows:
    """The person in a batch of windows; world frame, metres."""

    joints: Float[Tensor, "b frames 24 3"]
    """22 body joints, left palm, right palm; joint 0 is the root."""
    rotations_6d: Float[Tensor, "b frames 22 2 3"]
    """Global rotations, first two columns."""
    hand_contact: Float[Tensor, "b frames 2"]
    foot_contact: Float[Tensor, "b frames 4"]
    reference: Float[Tensor, "b frames 2"]
    """Floor point that the body is measured from: `stages.body.capture.reference_path`."""
    upright: Float[Tensor, " b"]
    """Rank among people whose hands go as low: 0 squats the deepest, 1 stands the straightest."""


def window_frames(frames: int) -> Int[Tensor, "windows window"]:
    """Frame of the motion at each place of each window; the last frame is repeated as padding.

    Windows overlap by half; the last one is moved back so that it is full.
    """
    starts = list(range(0, max(frames - WINDOW, 0) + 1, STRIDE))
    if frames > WINDOW and starts[-1] != frames - WINDOW:
        starts.append(frames - WINDOW)
    index = torch.tensor(starts)[:, None] + torch.arange(WINDOW)
    return index.clamp(max=frames - 1)


def object_windows(
    moving: ObjectFeatures, index: Int[Tensor, "windows window"], samples: int, basis_points: int
) -> ObjectWindows:
    """The object's windows, repeated for each sample: batch = samples x windows, sample-major."""

    def cut(x: np.ndarray) -> Tensor:
        rows = torch.from_numpy(np.asarray(x, np.float32))[index]
        return rows.repeat(samples, *[1] * (rows.ndim - 1))

    def shape(R_canonical_object: Float[Tensor, "b tokens 3 3"]) -> Tensor:
        R = R_canonical_object.flatten(0, 1).numpy().astype(np.float64)
        code = encode(moving.surface.tree, moving.surface.centre, R, basis_points)
        return torch.from_numpy(code.astype(np.float32)).unflatten(0, R_canonical_object.shape[:2])

    valid = torch.arange(WINDOW) < moving.frames
    count = samples * len(index)
    return ObjectWindows(
        centre=cut(moving.centre),
        lowest=cut(moving.lowest),
        velocity=cut(moving.velocity),
        spin=cut(moving.spin),
        R_world_object=cut(moving.motion.T_world_object[:, :3, :3]),
        shape=shape,
        present=torch.ones(count, dtype=torch.bool),
        valid=valid.expand(count, WINDOW),
    )
