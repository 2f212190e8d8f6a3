"""A trained stage: a denoiser with the statistics that put its features on one scale, and its file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from omomo_core.diffusion.blocks import DenoiserConfig
from omomo_core.diffusion.denoiser import Denoiser
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
