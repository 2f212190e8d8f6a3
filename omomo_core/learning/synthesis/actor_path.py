"""The actor's base motion, as smooth as what is carried or led along follows it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.base_motion import BaseMotion
from omomo_core.learning.synthesis.directions import ahead_of, left_of
from omomo_core.learning.synthesis.footage import heading
from omomo_core.motion import FPS

_SIGMA = 9.0
"""Frames over which wheels smooth the way of their owner."""
_MOVES = 0.25
"""Metres per second; slower is standing."""


@dataclass(frozen=True)
class ActorPath:
    """A smooth pelvis path and heading, world, metres and radians."""

    joints: Float[np.ndarray, "frames 24 3"]
    """As they are, steps and all; joint 0 is the pelvis."""
    xy: Float[np.ndarray, "frames 2"]
    yaw: Float[np.ndarray, " frames"]

    @property
    def ahead(self) -> Float[np.ndarray, "frames 2"]:
        """Unit vectors along the heading."""
        return ahead_of(self.yaw)

    @property
    def left(self) -> Float[np.ndarray, "frames 2"]:
        """Unit vectors to the left of it."""
        return left_of(self.yaw)

    def straight(self, span: tuple[int, int]) -> float:
        """Where it moves: mean cosine between way and heading; 0 where it hardly moves at all."""
        rows = slice(*span)
        velocity = np.gradient(self.xy[rows], 1 / FPS, axis=0)
        speed = np.linalg.norm(velocity, axis=-1)
        moves = speed > _MOVES
        if moves.sum() < FPS:
            return 0.0
        return float(
            ((velocity * self.ahead[rows]).sum(-1) / np.maximum(speed, 1e-9))[moves].mean()
        )


def actor_path(
    body: BodyModel, base_motion: BaseMotion, sigma: float = _SIGMA, turning: float = 1.3 * _SIGMA
) -> ActorPath:
    """Smooth away what steps add to path and heading, over so many frames each (one sigma)."""
    return ActorPath(
        joints=joints_of(body, base_motion.root, base_motion.rotations),
        xy=gaussian_filter1d(base_motion.root[:, :2], sigma, axis=0, mode="nearest"),
        yaw=gaussian_filter1d(heading(base_motion.rotations), turning, mode="nearest"),
    )
