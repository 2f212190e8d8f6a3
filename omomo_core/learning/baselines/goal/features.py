"""Input features of GOAL: the last poses, and the way from the body to the object's next surface."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.body.kinematics import full_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.skinning import skin
from omomo_core.geometry.human_frame import human_frame
from omomo_core.geometry.rotations import yaw_matrix
from omomo_core.skeleton import PALM_JOINTS
from omomo_core.stages.body.paper import POSITIONS, pack

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
