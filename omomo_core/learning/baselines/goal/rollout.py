"""GOAL rolled out: it predicts ten frames, looks again from the last of them, and so on.

Taking the first of the ten alone and looking at every frame feeds its own small errors back ten times as
often: people then drift off the floor and away.
"""

import math

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.generation.sampling.paper import PersonView
from omomo_core.geometry.human_frame import out_of_frame
from omomo_core.geometry.object_features import ObjectFeatures
from omomo_core.geometry.rotations import yaw_matrix
from omomo_core.learning.baselines.goal.features import (
    LocalHistory,
    ObjectFrames,
    PoseHistory,
    feelers,
    goal_features,
)
from omomo_core.learning.baselines.goal.network import PAST, POSE, Goal
from omomo_core.learning.training.shapes import KEPT
from omomo_core.skeleton import joint
from omomo_core.stages.body.paper import from_rows

_HANGING = math.radians(75)
"""How far the arms of somebody who stands hang down from the T-pose."""

Poses = tuple[Float[Tensor, "b 3"], Float[Tensor, "b 22 3 3"]]
"""Root, and global rotations; world, metres."""


def roll_out(
    network: Goal, take: ObjectFeatures, first: Poses, body: BodyModel
) -> tuple[Float[Tensor, "b frames 3"], Float[Tensor, "b frames 22 3 3"]]:
    """Return root and rotations of each person from the pose in the first frame; deterministic.

    Args:
        network: trained.
        take: the object's motion.
        first: poses in its first frame; before it everybody stood still.
        body: whose bones they have.
    """
    felt, count = feelers(body, network.feelers), len(first[0])
    root, turned = (x[:, None] for x in first)
    with torch.inference_mode():
        while (now := root.shape[1] - 1) < take.frames - 1:
            seen = torch.arange(now + 1 - PAST, now + 1).clamp(min=0)
            joints = forward_kinematics(body, root[:, seen], turned[:, seen])
            moment = PoseHistory(joints, turned[:, seen], _things(take, now + 1, count))
            coming = _coming(network, goal_features(moment, felt))
            root, turned = (torch.cat(x, dim=1) for x in zip((root, turned), coming, strict=True))
    return root[:, : take.frames], turned[:, : take.frames]


def standing(view: PersonView, body: BodyModel) -> Poses:
    """People who stand upright where the view is seen from, arms hanging."""
    count = len(view.yaw)
    local = torch.eye(3).repeat(22, 1, 1)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        # At rest y is up and the person faces z: arms swing about z.
        c, s = math.cos(_HANGING), sign * math.sin(_HANGING)
        turn = torch.tensor([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        for name in ("shoulder", "elbow", "wrist"):
            local[joint(f"{side}_{name}")] = turn
    R_frame_rest = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    height = float(body.rest_joints[0, 1] - body.vertices[:, 1].min())
    root = view.origin + torch.tensor([0.0, 0.0, height])
    return root, yaw_matrix(view.yaw)[:, None] @ (R_frame_rest @ local).expand(count, 22, 3, 3)


def _things(take: ObjectFeatures, frame: int, count: int) -> ObjectFrames:
    surface = torch.from_numpy(take.surface.points[:KEPT] - take.surface.centre).float()
    centre = torch.from_numpy(take.centre[frame]).float()
    R = torch.from_numpy(take.motion.T_world_object[frame, :3, :3]).float()
    return ObjectFrames(
        surface.expand(count, -1, 3), centre.expand(count, 1, 3), R.expand(count, 1, 3, 3)
    )


def _coming(
    network: Goal, seen: LocalHistory
) -> tuple[Float[Tensor, "b 10 3"], Float[Tensor, "b 10 22 3 3"]]:
    """Return root and rotations of the next ten frames, in the world."""
    pose = seen.pose[:, None] + network(seen.features)[..., :POSE]
    root = out_of_frame(pose[..., :3], seen.origin, seen.yaw)
    return root, yaw_matrix(seen.yaw)[:, None, None] @ from_rows(pose[..., 3:])
