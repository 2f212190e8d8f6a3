"""A take as the stages see it: features of the object per frame, cut into overlapping windows."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.geometry.bps import encode
from omomo_core.geometry.surface import Surface, sample_surface
from omomo_core.geometry.transforms import angular_velocity, velocity
from omomo_core.motion import FPS, ObjectMotion
from omomo_core.windows import WINDOW, ObjectWindows

STRIDE = WINDOW // 2


@dataclass(frozen=True)
class Take:
    """One object motion with everything that is computed from it once."""

    motion: ObjectMotion
    surface: Surface
    centre: Float[np.ndarray, "frames 3"]
    """Mean of the surface, world, metres."""
    lowest: Float[np.ndarray, " frames"]
    velocity: Float[np.ndarray, "frames 3"]
    spin: Float[np.ndarray, "frames 3"]

    @property
    def frames(self) -> int:
        """Length of the take."""
        return len(self.centre)


def prepare(motion: ObjectMotion, surface: Surface | None = None) -> Take:
    """Compute a take's features; the surface of its mesh is sampled unless it is there already."""
    T = motion.T_world_object
    surface = surface or sample_surface(motion.mesh)
    centre = T[:, :3, :3] @ surface.centre + T[:, :3, 3]
    return Take(
        motion=motion,
        surface=surface,
        centre=centre,
        lowest=(surface.outline @ T[:, 2, :3].T).min(axis=0) + T[:, 2, 3],
        velocity=velocity(centre, FPS),
        spin=angular_velocity(T[:, :3, :3], FPS),
    )


def window_frames(frames: int) -> Int[Tensor, "windows window"]:
    """Frame of the take at each place of each window; the last frame is repeated as padding.

    Windows overlap by half; the last one is moved back so that it is full.
    """
    starts = list(range(0, max(frames - WINDOW, 0) + 1, STRIDE))
    if frames > WINDOW and starts[-1] != frames - WINDOW:
        starts.append(frames - WINDOW)
    index = torch.tensor(starts)[:, None] + torch.arange(WINDOW)
    return index.clamp(max=frames - 1)


def object_windows(
    take: Take, index: Int[Tensor, "windows window"], samples: int, basis_points: int
) -> ObjectWindows:
    """The take's windows, repeated for each sample: batch = samples x windows, sample-major."""

    def cut(x: np.ndarray) -> Tensor:
        rows = torch.from_numpy(np.asarray(x, np.float32))[index]
        return rows.repeat(samples, *[1] * (rows.ndim - 1))

    def shape(R_canonical_object: Float[Tensor, "b tokens 3 3"]) -> Tensor:
        R = R_canonical_object.flatten(0, 1).numpy().astype(np.float64)
        code = encode(take.surface.tree, take.surface.centre, R, basis_points)
        return torch.from_numpy(code.astype(np.float32)).unflatten(0, R_canonical_object.shape[:2])

    valid = torch.arange(WINDOW) < take.frames
    count = samples * len(index)
    return ObjectWindows(
        centre=cut(take.centre),
        lowest=cut(take.lowest),
        velocity=cut(take.velocity),
        spin=cut(take.spin),
        R_world_object=cut(take.motion.T_world_object[:, :3, :3]),
        shape=shape,
        present=torch.ones(count, dtype=torch.bool),
        valid=valid.expand(count, WINDOW),
    )
