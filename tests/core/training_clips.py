"""A few short clips to train on."""

import numpy as np
import trimesh

from omomo_core.body.model import load_body
from omomo_core.learning.recordings.clips import Clip
from omomo_core.motion import ObjectMesh, ObjectMotion

BODY = load_body()
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def clip(k: int, frames: int, *, with_object: bool) -> Clip:
    """A stiff person who glides along x with waving rotations, and perhaps a box."""
    rng = np.random.default_rng(k)
    solid = trimesh.creation.box((0.3, 0.4, 0.5))
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, 0, 3], T[:, 2, 3] = np.linspace(0, 2, frames), 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), f"box{k}")
    turns = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    rotations = np.tile(UPRIGHT, (frames, 22, 1, 1))
    rotations[:, 18] = turns
    root = np.zeros((frames, 3))
    root[:, 0], root[:, 2] = np.linspace(0, 2, frames), 0.95
    return Clip(
        name=f"clip{k}",
        source="test",
        licence="CC0",
        root=root,
        rotations=rotations,
        hand_contact=np.tile([1.0, 0.0], (frames, 1)),
        foot_contact=np.tile([1.0, 0.0, 1.0, 0.0], (frames, 1)),
        object_motion=ObjectMotion(mesh, T, np.ones(frames, bool)) if with_object else None,
    )


CLIPS = [clip(k, 100 + 30 * k, with_object=k % 2 == 1) for k in range(4)]
