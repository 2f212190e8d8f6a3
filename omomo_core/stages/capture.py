"""What both stages of the `capture` configuration share: their size, and how they see a shape."""

from jaxtyping import Float
from torch import Tensor

from omomo_core.diffusion.blocks import DenoiserConfig
from omomo_core.geometry.rotations import yaw_matrix
from omomo_core.stages.stage import StageConfig, StageName
from omomo_core.stages.windows import ObjectWindows

BASIS_POINTS = 256
PATCH = 4
LEVEL_SHIFT = 4.0
"""Training and sampling lean to high noise levels: 32 of 100 are above 900.

The features are redundant, so only much noise hides the motion, and it is decided at those levels.
"""


def stage_config(stage: StageName, channels: int, condition: int) -> StageConfig:
    """A stage of 3.5 to 4 million weights: a step of K samples takes a laptop's CPU little time."""
    sizes = DenoiserConfig(
        channels=channels,
        condition=condition,
        shape=3 * BASIS_POINTS,
        shape_hidden=256,
        shape_width=128,
        width=256,
        head_width=64,
        feedforward=1024,
        patch=PATCH,
        mask_keys=True,
        dropout=0.0,
        modulated=True,
    )
    return StageConfig(
        stage=stage, configuration="capture", denoiser=sizes, level_shift=LEVEL_SHIFT
    )


def shape_code(windows: ObjectWindows, yaw: Float[Tensor, " b"]) -> Float[Tensor, "b tokens shape"]:
    """BPS of the object in the middle of each patch, canonical axes, zero where there is none."""
    R_world_object = windows.R_world_object[:, PATCH // 2 :: PATCH]
    R_canonical_object = yaw_matrix(-yaw)[:, None].to(R_world_object.dtype) @ R_world_object
    code = windows.shape(R_canonical_object).flatten(-2)
    return code * windows.present[:, None, None]
