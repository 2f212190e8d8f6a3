"""What is known of the person beforehand: where the hands are, or the pose in the first frame."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body_stage import capture as body_stage
from omomo_core.generation.fit import Fit
from omomo_core.generation.scene import Scene
from omomo_core.geometry.rotations import rotmat_to_6d
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import HandMotion

FADE = 20
"""Frames over which what is known of the first frame pulls on those after it."""
TOUCH = 0.05
"""Metres between palm joint and surface that count as holding in a given pose."""


@dataclass(frozen=True)
class Pose:
    """How a person stands in one frame, on the bones of the body that is asked for."""

    root: Float[np.ndarray, "3"]
    """Pelvis joint, world, metres."""
    rotations: Float[np.ndarray, "22 3 3"]
    """Global R_world_joint."""


@dataclass(frozen=True)
class Known:
    """What the generator need not guess."""

    hands: HandMotion | None = None
    """The palms of every frame and which of them touch: stage 1 is left out."""
    first_frame: Pose | None = None
    """Start from this pose."""


NOTHING = Known()


@dataclass(frozen=True)
class Pin:
    """Features of frame 0 that are given (raw units, world axes)."""

    values: Float[Tensor, " channels"]
    given: Bool[Tensor, " channels"]

    def hold(self, x: Float[Tensor, "*b frames channels"]) -> Float[Tensor, "*b frames channels"]:
        """Frame 0 as given; what that changes fades out over the frames after it."""
        change = torch.where(self.given, self.values - x[..., 0, :], 0.0)
        return x + fade(x.shape[-2]).to(x)[:, None] * change[..., None, :]


def fade(frames: int) -> Float[Tensor, " frames"]:
    """1 at the first frame, smoothly to 0 at FADE."""
    t = (torch.arange(frames) / FADE).clamp(max=1)
    return 1 - t * t * (3 - 2 * t)


def hands_pin(pose: Pose, scene: Scene, fit: Fit) -> Pin:
    """Stage 1's features of a pose: palms from the object's centre, contact as -1 or 1."""
    palms = _joints(pose, fit.body)[22:]
    T = inverse(scene.take.motion.T_world_object[:1])[0]
    distance, _ = scene.take.surface.tree.query(palms @ T[:3, :3].T + T[:3, 3])
    relative = palms * scene.scale - scene.trained.centre[0]
    values = np.concatenate([relative.ravel(), np.where(distance < TOUCH, 1.0, -1.0)])
    return Pin(torch.from_numpy(values).float(), torch.ones(8, dtype=torch.bool))


def body_pin(pose: Pose, reference: Float[Tensor, "2"], fit: Fit) -> Pin:
    """Stage 2's features of a pose; whether its feet are planted is left to the network."""
    R = torch.from_numpy(pose.rotations).float()
    root = fit.to_trained(torch.from_numpy(pose.root).float(), R[0])
    joints = forward_kinematics(fit.trained, root, R)
    from_floor = root - torch.cat([reference, torch.zeros(1)])
    vectors = torch.cat([from_floor[None], joints[1:] - root, rotmat_to_6d(R).flatten(0, 1)])
    values = torch.cat([vectors.flatten(), torch.zeros(body_stage.LAYOUT.scalars)])
    return Pin(values, torch.arange(len(values)) < 3 * body_stage.LAYOUT.vectors)


def start_from(hands: HandMotion, pose: Pose, fit: Fit) -> HandMotion:
    """Palms that begin where the pose has them."""
    change = _joints(pose, fit.body)[22:] - hands.palms[0]
    weight = fade(len(hands.palms)).double().numpy()[:, None, None]
    return replace(hands, palms=hands.palms + weight * change)


def _joints(pose: Pose, body: BodyModel) -> Float[np.ndarray, "24 3"]:
    root, R = torch.from_numpy(pose.root), torch.from_numpy(pose.rotations)
    return forward_kinematics(body, root, R).numpy()
