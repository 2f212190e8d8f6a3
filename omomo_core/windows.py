"""What the stages see of a take: batches of windows, in the world, as tensors."""

from collections.abc import Callable
from dataclasses import dataclass

from jaxtyping import Bool, Float
from torch import Tensor

WINDOW = 120
"""Frames in a window: 4 s at 30 fps, as in the paper."""

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
    six: Float[Tensor, "b frames 22 2 3"]
    """Global rotations, first two columns."""
    hand_contact: Float[Tensor, "b frames 2"]
    foot_contact: Float[Tensor, "b frames 4"]
    reference: Float[Tensor, "b frames 2"]
    """Floor point that the body is measured from: `body_stage.capture.reference_path`."""
    upright: Float[Tensor, " b"]
    """From 0, squatting as deep as anybody whose hands go as low, to 1, standing as straight."""
