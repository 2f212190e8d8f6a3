"""People who stand, and blocks in their way."""

import numpy as np
import torch
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.model import load_body
from omomo_core.body.trajectory_optimization.obstacle import MeshObstacle
from omomo_core.generation.solving.foot_plan import ANKLES
from omomo_core.geometry.distance_field import distance_field
from omomo_core.motion import ObjectMesh

BODY = load_body()
FRAMES = 60
FACING_X = torch.from_numpy(Rotation.from_euler("xz", [90, 90], degrees=True).as_matrix()).float()
FLOOR = -float(BODY.vertices[:, 1].min())
Pose = tuple[torch.Tensor, torch.Tensor]


def standing() -> Pose:
    """Feet on the floor, knees a little bent, arms hanging, looking along x."""
    root = torch.tensor([0.0, 0.0, float(BODY.rest_joints[0, 1]) + FLOOR - 0.02])
    root, R = root.expand(1, FRAMES, 3).clone(), FACING_X.expand(1, FRAMES, 22, 3, 3).clone()
    joints = forward_kinematics(BODY, root, R)
    for side, y in enumerate((0.22, -0.22)):
        ankle = joints[..., ANKLES[side], :] + torch.tensor([0.0, 0.0, 0.02])
        leg, arm = (("left_leg", "left_arm"), ("right_leg", "right_arm"))[side]
        R, _ = reach(BODY, root, R, leg, ankle)
        R, _ = reach(BODY, root, R, arm, torch.tensor([0.05, y, 0.85]).expand(1, FRAMES, 3))
    return root, R


def block(low: tuple[float, ...], high: tuple[float, ...]) -> MeshObstacle:
    solid = trimesh.creation.box(bounds=[low, high])
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "block")
    return MeshObstacle(distance_field(mesh), torch.zeros(3))


def at(place: np.ndarray | None = None) -> np.ndarray:
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    if place is not None:
        T[:, :3, 3] = place
    return T
