"""Stage 1 as published (OMOMO section 3.3): absolute palms in the person's first-frame frame."""

from jaxtyping import Float
from torch import Tensor

from omomo_core.geometry.bps import PAPER_POINTS
from omomo_core.geometry.human_frame import into_frame, out_of_frame
from omomo_core.geometry.rotations import yaw_matrix
from omomo_core.stages.paper import Size, stage_config
from omomo_core.stages.stage import StageConfig
from omomo_core.stages.windows import ObjectWindows


def config(size: Size) -> StageConfig:
    """Object centre and BPS in, palms out."""
    return stage_config("hands", size, channels=6, condition=3, shape=3 * PAPER_POINTS)


CONFIG = config("published")


def condition(
    windows: ObjectWindows, origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames 3"]:
    """The object's centre in the frame, metres."""
    return into_frame(windows.centre, origin, yaw)


def shape_code(
    windows: ObjectWindows, yaw: Float[Tensor, " b"], patch: int
) -> Float[Tensor, "b tokens shape"]:
    """BPS in the frame's axes, in the middle of each patch of so many frames."""
    R_world_object = windows.R_world_object[:, patch // 2 :: patch]
    R_frame_world = yaw_matrix(-yaw)[:, None].to(R_world_object.dtype)
    return windows.shape(R_frame_world @ R_world_object).flatten(-2)


def pack(
    palms: Float[Tensor, "b frames 2 3"], origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames 6"]:
    """Palm positions in the frame."""
    return into_frame(palms, origin, yaw).flatten(-2)


def unpack(
    x: Float[Tensor, "b frames 6"], origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> Float[Tensor, "b frames 2 3"]:
    """Palms in the world."""
    return out_of_frame(x.unflatten(-1, (2, 3)), origin, yaw)
