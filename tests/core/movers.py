"""Somebody who moves a box, without files: a recorded clip, and people who resemble them."""

from dataclasses import replace

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel, load_body
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.evaluation.truth import recorded_person
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def thin(body: BodyModel) -> BodyModel:
    """The body with few vertices: quick to move."""
    return replace(
        body,
        vertices=body.vertices[::50],
        skin_joints=body.skin_joints[::50],
        skin_weights=body.skin_weights[::50],
    )


def mover(name: str, frames: int, seed: int = 0) -> RealClip:
    """A person on our body who walks, the left palm on a vertex of a box until near the end."""
    body, rng = load_body(), np.random.default_rng(seed)
    sway = np.cumsum(rng.normal(0, 0.02, (frames, 22, 3)), axis=0)
    turns = Rotation.from_rotvec(sway.reshape(-1, 3)).as_matrix().reshape(frames, 22, 3, 3)
    R, root = turns @ UPRIGHT, np.tile([0.0, 0.0, float(body.rest_joints[0, 1])], (frames, 1))
    root[:, 0] += np.linspace(0, 0.01 * frames, frames)
    joints = joints_of(body, root, R)
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, :3, :3] = Rotation.from_euler("z", np.linspace(0, 1, frames)[:, None]).as_matrix()
    solid = trimesh.creation.box((0.3, 0.4, 0.5)).subdivide().subdivide()
    away = np.linspace(-0.7, 0.3, frames).clip(min=0)[:, None] * [1.0, 0.0, 0.0]
    T[:, :3, 3] = joints[:, 22] - T[:, :3, :3] @ solid.vertices[40] + away
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    motion = ObjectMotion(mesh, T, np.ones(frames, bool))
    return RealClip(name, "", motion, root, R, joints, body)


def resembling(clip: RealClip, away: float, seed: int) -> HumanMotion:
    """The person of a clip, somewhere else and turned, by so many metres and radians."""
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(away * rng.normal(size=(len(clip.root) * 22, 3))).as_matrix()
    R = turn.reshape(-1, 22, 3, 3) @ clip.rotations
    root = clip.root + away * rng.normal(size=3)
    person = recorded_person(clip, clip.body)
    return replace(person, root=root, rotations=R, joints=joints_of(clip.body, root, R))
