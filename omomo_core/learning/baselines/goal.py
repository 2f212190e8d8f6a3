"""GOAL (Taheri et al. 2022) adapted to moving objects: features, network, losses and rollout.

GOAL has losses on the vertices of the body (L1, weight 10), of the hand (7) and of the feet (3), on the
pose (L2, 10) and on the hand's distances to the object (L1, 10). Here joints stand for vertices, found from
the predicted pose, and both hands count.

Taking the first of the ten alone and looking at every frame feeds its own small errors back ten times as
often: people then drift off the floor and away.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from omomo_core.body.kinematics import forward_kinematics, full_kinematics, skin
from omomo_core.body.model import BodyModel, load_body
from omomo_core.compute import quick_in_bf16
from omomo_core.generation.paper_generator import PersonView
from omomo_core.geometry.object_features import ObjectFeatures
from omomo_core.geometry.rotations import human_frame, out_of_frame, rotmat_from_6d, yaw_matrix
from omomo_core.learning.training.corpus import KEPT, Corpus, Windows
from omomo_core.learning.training.training_task import Mean, TrainOptions
from omomo_core.skeleton import PALM_JOINTS, joint
from omomo_core.stages.body_paper import POSITIONS, from_rows, pack
from omomo_core.stages.stage_config import Size

BODY_POINTS, HAND_POINTS = 200, 50
"""Vertices that feel for the object: over the whole body, and about each palm (GOAL: 400 and 99 of
one hand)."""
_HAND = 0.1
"""Metres from the palm joint within which a vertex is the hand's."""


@dataclass(frozen=True)
class ObjectFrames:
    """The object of each row of a batch in some frames; world, metres."""

    surface: Float[Tensor, "b points 3"]
    """Points in the object's axes, from its centre."""
    centre: Float[Tensor, "b frames 3"]
    R_world_object: Float[Tensor, "b frames 3 3"]

    def nearest(self, points: Float[Tensor, "b frames n 3"]) -> Float[Tensor, "b frames n 3"]:
        """From world points to the nearest surface point in the same frame, world axes, metres."""
        query = ((points - self.centre[:, :, None]) @ self.R_world_object).flatten(1, 2)
        # The nearest p has the largest q.p - p.p/2. One row at a time stays in the cache, and `max`
        # is faster than `argmax`: four times together.
        half = -0.5 * self.surface.square().sum(dim=-1, keepdim=True)
        query1 = torch.cat([query, torch.ones_like(query[..., :1])], dim=-1)
        surface1 = torch.cat([self.surface, half], dim=-1).mT
        rows = zip(query1, surface1, strict=True)
        found = torch.stack([(q @ p).max(dim=-1).indices for q, p in rows])
        way = torch.gather(self.surface, 1, found[..., None].expand(-1, -1, 3)) - query
        return way.view_as(points) @ self.R_world_object.mT


@dataclass(frozen=True)
class PoseHistory:
    """Five frames of each person, the current one last, and the object in the next; world, metres."""

    joints: Float[Tensor, "b 5 24 3"]
    rotations: Float[Tensor, "b 5 22 3 3"]
    next: ObjectFrames


@dataclass(frozen=True)
class LocalHistory:
    """A moment in the frame in which the person stands and faces now (`human_frame`)."""

    features: Float[Tensor, "b features"]
    pose: Float[Tensor, "b 135"]
    """Root, and two rows of each rotation, of the current frame."""
    ways: Float[Tensor, "b 6"]
    """From the palms to the object's surface."""
    origin: Float[Tensor, "b 3"]
    yaw: Float[Tensor, " b"]


def goal_features(moment: PoseHistory, felt: BodyModel) -> LocalHistory:
    """Features of a moment.

    The four past poses are told by their difference from the current one, the object by the ways from
    the body's points to its surface: a BPS whose basis is the body.

    Args:
        moment: what there is.
        felt: the body, reduced to the points that feel (`feelers`).
    """
    joints, R = moment.joints[:, -1], moment.rotations[:, -1]
    origin, yaw = human_frame(joints[:, 0], R[:, 0])
    poses = pack(moment.joints, moment.rotations, origin, yaw)
    current = poses[:, -1]
    fingers = felt.relaxed_fingers.to(R).expand(len(R), 30, 3, 3)
    points = skin(felt, *full_kinematics(felt, joints[:, 0], R, fingers))
    asked = torch.cat([points, joints[:, 22:]], dim=1)
    ways = (moment.next.nearest(asked[:, None])[:, 0] @ yaw_matrix(yaw).to(R)).flatten(1)
    past = (poses[:, :-1] - current[:, None]).flatten(1)
    return LocalHistory(
        features=torch.cat([current, past, ways[:, :-6]], dim=-1),
        pose=without_joints(current),
        ways=ways[:, -6:],
        origin=origin,
        yaw=yaw,
    )


def without_joints(x: Float[Tensor, "*b 204"]) -> Float[Tensor, "*b 135"]:
    """The root and the rotations of a packed pose."""
    return torch.cat([x[..., :3], x[..., POSITIONS:]], dim=-1)


def feelers(body: BodyModel, index: Int[Tensor, " n"]) -> BodyModel:
    """Return the body with these vertices only."""
    return replace(
        body,
        vertices=body.vertices[index],
        skin_joints=body.skin_joints[index],
        skin_weights=body.skin_weights[index],
    )


def spread_out(body: BodyModel) -> Int[np.ndarray, " n"]:
    """Return vertices spread evenly over the body, then over each hand (farthest point sampling)."""
    vertices = body.vertices.double().numpy()
    palms = body.rest_joints.double().numpy()[list(PALM_JOINTS)]
    parts = [_farthest(vertices, np.arange(len(vertices)), BODY_POINTS)]
    for palm in palms:
        hand = np.flatnonzero(np.linalg.norm(vertices - palm, axis=-1) < _HAND)
        parts.append(_farthest(vertices, hand, HAND_POINTS))
    return np.concatenate(parts)


def _farthest(
    vertices: Float[np.ndarray, "verts 3"], among: Int[np.ndarray, " some"], count: int
) -> Int[np.ndarray, " count"]:
    """Return vertices by farthest point sampling, beginning with the first."""
    points = vertices[among]
    chosen, apart = [0], np.linalg.norm(points - points[0], axis=-1)
    while len(chosen) < count:
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(points - points[chosen[-1]], axis=-1))
    return among[chosen]


PAST, FUTURE = 5, 10
"""Frames seen, the current one included, and frames predicted."""
POSE = 3 + 22 * 6
"""Numbers that are predicted of a frame: root, and two rows of each global rotation."""
SEEN = 72 + 22 * 6
"""Numbers that are seen of a frame: 24 joints, and the rotations."""
PALM_WAYS = 6
"""From both palms to the object's surface."""


@dataclass(frozen=True)
class GoalConfig:
    """Sizes of the network; the defaults are GOAL's own."""

    feelers: int = BODY_POINTS + 2 * HAND_POINTS
    """Points of the body that tell where the object's surface is."""
    widths: tuple[int, ...] = (2048, 1024, 1024, 2048)
    hidden: int = 256
    dropout: float = 0.3


def config(size: Size) -> GoalConfig:
    """The published trunk, or one of half the width."""
    return GoalConfig() if size == "published" else GoalConfig(widths=(1024, 512, 512, 1024))


class ResidualBlock(nn.Module):
    """Two linear layers with batch norm beside a skip, which is linear where the widths differ."""

    def __init__(self, inward: int, outward: int, hidden: int) -> None:
        super().__init__()
        self.inner = nn.Sequential(
            nn.Linear(inward, hidden),
            nn.BatchNorm1d(hidden),
            nn.LeakyReLU(0.2),
            nn.Linear(hidden, outward),
            nn.BatchNorm1d(outward),
        )
        same = nn.Identity()
        changed = nn.Sequential(nn.Linear(inward, outward), nn.LeakyReLU(0.2))
        self.skip = same if inward == outward else changed
        self.end = nn.LeakyReLU(0.2)

    def forward(self, x: Float[Tensor, "b inward"]) -> Float[Tensor, "b outward"]:
        """One block."""
        return self.end(self.inner(x) + self.skip(x))


class Goal(nn.Module):
    """Features of one moment in, offsets of the next ten frames out; all in the current frame's axes.

    `feelers` are the vertices of the body that the features were measured from in training.
    """

    def __init__(self, config: GoalConfig) -> None:
        super().__init__()
        self.config = config
        seen = PAST * SEEN + 3 * config.feelers
        self.feelers: Tensor
        self.register_buffer("feelers", torch.zeros(config.feelers, dtype=torch.int64))
        self.scale = nn.BatchNorm1d(seen)
        inward = (seen, config.widths[0] + seen, *config.widths[1:-1])
        self.blocks = nn.ModuleList(
            ResidualBlock(a, b, config.hidden) for a, b in zip(inward, config.widths, strict=True)
        )
        self.dropout = nn.Dropout(config.dropout)
        self.out = nn.Linear(config.widths[-1], FUTURE * (POSE + PALM_WAYS))

    def forward(self, features: Float[Tensor, "b features"]) -> Float[Tensor, "b 10 141"]:
        """Offsets of the pose (`POSE` numbers), then of the ways from the palms to the object."""
        first, second, *rest = self.blocks
        x = self.scale(features)
        h = self.dropout(first(x))
        h = self.dropout(second(torch.cat([h, x], dim=-1)))
        for block in rest:
            h = block(h)
        return self.out(h).unflatten(-1, (FUTURE, -1))


def build(config: dict[str, Any]) -> Goal:
    """From the configuration as JSON holds it."""
    widths = tuple(config.pop("widths"))
    return Goal(GoalConfig(**config, widths=widths))


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


MOMENTS = 8
"""Moments of each window: its frame 0, from where people set out, and random ones."""
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
