"""Windows: batches of stretches of a take as tensors, in the world, that the stages take in."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.geometry.bps import encode
from omomo_core.geometry.object_features import ObjectFeatures

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
