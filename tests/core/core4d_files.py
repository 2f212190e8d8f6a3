"""A take in CORE4D's layout: somebody who walks with a box in the left hand, and somebody without."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import load_body
from omomo_core.learning.recordings.smpl import world_rotations
from tests.core.rig_files import R_YUP_ZUP, stepping

SIZE = 1.05
"""Of the people, ours being 1."""
HIGH = 0.3
"""Metres from the floor to the origin of the take's world."""


def write_take(root: Path, **changes: Any) -> Path:
    """Write ``object_models`` and one take below `root`; returns the person who carries."""
    take = root / "human_object_motions" / "20231002" / "004"
    meshes = root / "object_models" / "box"
    take.mkdir(parents=True)
    meshes.mkdir(parents=True)
    trimesh.creation.box((0.3, 0.1, 0.3)).subdivide().export(meshes / "box007_m.obj")
    (take / "object_metadata.json").write_text(json.dumps({"obj_name": "Box007"}))
    carrier, T = carrying()
    aside = {**carrier, "joints": carrier["joints"] + np.array([3, 0, 0], np.float32)}
    np.save(take / "smooth_objposes.npy", changes.pop("poses", T))
    kept = {k: v for k, v in {**carrier, **changes}.items() if v is not None}
    # As the authors write them: a dict, which numpy pickles.
    np.savez(take / "person1_poses.npz", np.array(kept, dtype=object))
    np.savez(take / "person2_poses.npz", np.array(aside, dtype=object))
    return take / "person1_poses.npz"


def carrying() -> tuple[dict[str, np.ndarray], np.ndarray]:
    """SMPL-X parameters and joints, and the box's poses: y up, 15 frames a second."""
    root, pose = stepping(120)
    R = world_rotations(pose)
    joints = joints_of(load_body(), root, R)
    palm = joints[:, 22] + R[:, 20] @ [0.0, -0.07, 0.0]
    joints, palm = (x * SIZE - np.array([0.0, 0.0, HIGH]) for x in (joints, palm))
    every = np.zeros((len(root), 127, 3))
    every[:, :22], every[:, [28, 43]] = joints[:, :22], joints[:, 22:]
    T = np.tile(np.eye(4), (len(root), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = R_YUP_ZUP @ R[:, 20], palm @ R_YUP_ZUP.T
    orient = R_YUP_ZUP @ R[:, 0]
    person = {
        "betas": np.zeros((len(root), 10)),
        "global_orient": Rotation.from_matrix(orient).as_rotvec(),
        "transl": root @ R_YUP_ZUP.T,
        "body_pose": pose[:, 1:],
        "joints": every @ R_YUP_ZUP.T,
    }
    return {k: v.astype(np.float32) for k, v in person.items()}, T
