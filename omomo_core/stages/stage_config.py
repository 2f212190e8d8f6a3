"""Sizes of the networks of both configurations, capture and paper."""

from dataclasses import dataclass
from typing import Literal

from jaxtyping import Float
from torch import Tensor

from omomo_core.config import setting
from omomo_core.diffusion.denoiser import DenoiserConfig
from omomo_core.geometry.rotations import yaw_matrix
from omomo_core.stages.stage import ObjectWindows, StageConfig, StageName


@dataclass(frozen=True)
class HandStageConfig:
    """Headings in which samples of the hands are generated."""

    heading_spread: float = setting(
        0.4, "rad", "Standard deviation of headings from the heading of travel."
    )
    uniform_every: int = setting(4, "samples", "One heading of so many is uniform over the circle.")


@dataclass(frozen=True)
class BodyStageConfig:
    """The path from which the body is measured."""

    reference_smoothing: float = setting(
        10.0, "frames", "Standard deviation of the filter over the reference path."
    )


@dataclass(frozen=True)
class ContactRuleConfig:
    """The paper's contact constraint."""

    touch: float = setting(
        0.03,
        "m",
        "Distance from palm to nearest vertex that counts as touching (OMOMO, section 3.3).",
    )


HAND_STAGE = HandStageConfig()
BODY_STAGE = BodyStageConfig()
CONTACT_RULE = ContactRuleConfig()


@dataclass(frozen=True)
class StagesConfig:
    """All numbers of the stages."""

    hands: HandStageConfig = HAND_STAGE
    body: BodyStageConfig = BODY_STAGE
    contact_rule: ContactRuleConfig = CONTACT_RULE


STAGES = StagesConfig()


BASIS_POINTS = 256
PATCH = 4
LEVEL_SHIFT = 4.0
"""Training and sampling lean to high noise levels: 32 of 100 are above 900.

The features are redundant, so only much noise hides the motion, and it is decided at those levels.
"""


def capture_stage_config(stage: StageName, channels: int, condition: int) -> StageConfig:
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


Size = Literal["published", "laptop"]
"""`laptop` has the inputs, outputs, losses and diffusion of `published`, and a smaller trunk: a step of
32 windows takes a third of a second of one core instead of five seconds."""


def paper_stage_config(
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
