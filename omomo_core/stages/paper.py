"""What the networks of the paper share: their size (OMOMO section 3.2), or that of a laptop."""

from typing import Literal

from omomo_core.diffusion.blocks import DenoiserConfig
from omomo_core.stages.stage import StageConfig, StageName

Size = Literal["published", "laptop"]
"""`laptop` has the inputs, outputs, losses and diffusion of `published`, and a smaller trunk: a step of
32 windows takes a third of a second of one core instead of five seconds."""


def stage_config(
    stage: StageName, size: Size, *, channels: int, condition: int, shape: int = 0
) -> StageConfig:
    """A network of the paper that sees and says so many numbers in each frame."""
    sizes = DenoiserConfig(channels=channels, condition=condition, shape=shape)
    if size == "laptop":
        sizes = DenoiserConfig(
            channels=channels,
            condition=condition,
            shape=shape,
            shape_hidden=256,
            shape_width=128,
            width=256,
            head_width=64,
            patch=4,
        )
    return StageConfig(stage=stage, configuration="paper", denoiser=sizes, clamp=True)
