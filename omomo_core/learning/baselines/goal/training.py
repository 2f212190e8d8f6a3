"""How GOAL learns: moments of the training windows, and its losses where they apply.

GOAL has losses on the vertices of the body (L1, weight 10), of the hand (7) and of the feet (3), on the
pose (L2, 10) and on the hand's distances to the object (L1, 10). Here joints stand for vertices, found from
the predicted pose, and both hands count.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.load import load_body
from omomo_core.geometry.rotations import rotmat_from_6d, yaw_matrix
from omomo_core.learning.baselines.goal.features import (
    ObjectFrames,
    PoseHistory,
    feelers,
    goal_features,
    spread_out,
    without_joints,
)
from omomo_core.learning.baselines.goal.network import FUTURE, PAST, POSE, Goal, GoalConfig
from omomo_core.learning.training.corpus import Corpus, Windows
from omomo_core.learning.training.training_task import Mean, TrainOptions
from omomo_core.precision import quick_in_bf16
from omomo_core.stages.body.paper import POSITIONS, from_rows, pack

MOMENTS = 8
"""Of each window: its frame 0, from where people set out, and random ones."""
FEET = [7, 8, 10, 11]
BODY_WEIGHT, PALM_WEIGHT, FEET_WEIGHT, POSE_WEIGHT, WAY_WEIGHT = 10.0, 7.0, 3.0, 10.0, 10.0


@dataclass(frozen=True)
class GoalExample:
    """Moments, and what came after them; in the frame of each moment."""

    features: Float[Tensor, "b features"]
    pose: Float[Tensor, "b 135"]
    ways: Float[Tensor, "b 6"]
    true_joints: Float[Tensor, "b 10 24 3"]
    true_pose: Float[Tensor, "b 10 135"]
    true_ways: Float[Tensor, "b 10 6"]
    valid: Bool[Tensor, "b 10"]


class GoalTraining:
    """The training task of GOAL."""

    name = "goal"
    muon: Sequence[nn.Parameter] = ()

    def __init__(self, config: GoalConfig) -> None:
        self.network = Goal(config)
        self.config = config
        self._body = load_body()

    def measure(self, corpus: Corpus, batch: int) -> None:
        """Choose the body's points; the scales are learnt with the batch norms."""
        self.network.feelers.copy_(torch.from_numpy(spread_out(self._body)))

    def draw(self, corpus: Corpus, count: int) -> GoalExample:
        """Some moments of each of `count` random windows."""
        w = corpus.draw(count, 0, objects_only=True)
        length = w.object.valid.sum(dim=1, keepdim=True)
        now = (torch.rand(count, MOMENTS) * (length - 1)).long()
        now[:, 0] = 0
        # Before its first frame a window knows nothing: people stood still.
        past = _rows(w, (now.flatten()[:, None] + torch.arange(1 - PAST, 1)).clamp(min=0))
        after = now.flatten()[:, None] + torch.arange(1, FUTURE + 1)
        row = torch.arange(count).repeat_interleave(MOMENTS)
        valid = after < length[row]
        coming = _rows(w, after.minimum(length[row] - 1))
        first = ObjectFrames(
            coming.things.surface,
            coming.things.centre[:, :1],
            coming.things.R_world_object[:, :1],
        )
        felt = feelers(self._body, self.network.feelers.cpu())
        seen = goal_features(PoseHistory(past.joints, past.rotations, first), felt)
        true = pack(coming.joints, coming.rotations, seen.origin, seen.yaw)
        R_world_frame = yaw_matrix(seen.yaw)[:, None]
        ways = coming.things.nearest(coming.joints[:, :, 22:]) @ R_world_frame
        return GoalExample(
            features=seen.features,
            pose=seen.pose,
            ways=seen.ways,
            true_joints=true[..., :POSITIONS].unflatten(-1, (24, 3)),
            true_pose=without_joints(true),
            true_ways=ways.flatten(-2),
            valid=valid,
        )

    def loss(
        self, forward: nn.Module, example: GoalExample, options: TrainOptions, mean: Mean
    ) -> Float[Tensor, ""]:
        """GOAL's losses, over the frames within the window."""
        e = example
        device = e.features.device
        with torch.autocast(device.type, torch.bfloat16, enabled=quick_in_bf16(device)):
            offsets = forward(e.features)
        offsets = offsets.float()
        pose = e.pose[:, None] + offsets[..., :POSE]
        ways = e.ways[:, None] + offsets[..., POSE:]
        joints = forward_kinematics(self._body, pose[..., :3], from_rows(pose[..., 3:]))
        count = mean(e.valid.sum()).clamp(min=1)

        def over(x: Tensor) -> Tensor:
            return (x.flatten(2).mean(dim=-1) * e.valid).sum() / count

        off = (joints - e.true_joints).abs()
        return (
            BODY_WEIGHT * over(off)
            + PALM_WEIGHT * over(off[:, :, 22:])
            + FEET_WEIGHT * over(off[:, :, FEET])
            + POSE_WEIGHT * over((pose - e.true_pose).square())
            + WAY_WEIGHT * over((ways - e.true_ways).abs())
        )


@dataclass(frozen=True)
class _Frames:
    """Frames of some windows' people and objects."""

    joints: Float[Tensor, "b frames 24 3"]
    rotations: Float[Tensor, "b frames 22 3 3"]
    things: ObjectFrames


def _rows(w: Windows, frame: Int[Tensor, "b frames"]) -> _Frames:
    """`MOMENTS` rows for each window, of these frames of it."""
    row = torch.arange(len(w.surface)).repeat_interleave(MOMENTS)[:, None]
    things = ObjectFrames(
        w.surface[row[:, 0]], w.object.centre[row, frame], w.object.R_world_object[row, frame]
    )
    return _Frames(
        w.human.joints[row, frame], rotmat_from_6d(w.human.rotations_6d[row, frame]), things
    )
