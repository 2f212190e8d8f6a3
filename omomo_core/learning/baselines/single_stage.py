"""The paper's "OMOMO-single-stage" (section 5.1): from the object straight to the body, no palms between.

Same denoiser, same condition as its first stage, same 204 numbers as its second.
"""

from omomo_core.geometry.bps import PAPER_POINTS
from omomo_core.stages.body.paper import CHANNELS
from omomo_core.stages.paper import Size, stage_config
from omomo_core.stages.stage import StageConfig


def config(size: Size) -> StageConfig:
    """Object centre and BPS in, body out."""
    return stage_config("single", size, channels=CHANNELS, condition=3, shape=3 * PAPER_POINTS)
