"""Points on the soles of a moving body."""

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.config import SOLE
from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.skeleton import joint

ANKLES = (joint("left_ankle"), joint("right_ankle"))
TOES = (joint("left_foot"), joint("right_foot"))


def sole_points(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
) -> Float[np.ndarray, "frames 4 3"]:
    """Return left heel, right heel, left and right ball of the foot, on the soles; world, metres."""
    joints = forward_kinematics(body, torch.as_tensor(root), torch.as_tensor(rotations)).numpy()
    rest = body.rest_joints.double().numpy()
    floor = float(body.vertices[:, 1].min())
    points: list[Float[np.ndarray, "frames 3"]] = []
    for j in ANKLES + TOES:
        behind = -SOLE.heel_behind_ankle if j in ANKLES else 0.0
        below = np.array([0.0, floor - rest[j, 1], behind])
        points.append(joints[:, j] + rotations[:, j] @ below)
    return np.stack(points, axis=1)
