"""Fixtures shared by every test."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

REPO = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of third-party data beside the repository; tests that need it skip without it."""
    folder = Path(os.environ.get("OMOCAP_SHARED", REPO.parent / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip("third-party data folder is not there (set OMOCAP_SHARED)")
    return folder


WriteClip = Callable[[str], tuple[np.ndarray, np.ndarray]]


@pytest.fixture
def write_clip(tmp_path: Path) -> WriteClip:
    """Writes a clip of our body carrying a box, in the layout that `omocap evaluate` reads.

    It goes to the test's folder under the given name, its mesh beside it; root and rotations as our
    body has them come back.
    """
    from omomo_core.body.kinematics import forward_kinematics
    from omomo_core.body.load import load_body
    from omomo_core.evaluation.clips import NAMES
    from omomo_core.evaluation.person import AXES

    upright = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])

    def write(name: str) -> tuple[np.ndarray, np.ndarray]:
        body, frames = load_body(), 30
        t = np.linspace(0, 1, frames)
        root = np.stack([0.5 * t, 0 * t, np.full(frames, float(body.rest_joints[0, 1]))], axis=1)
        R = np.tile(upright, (frames, 22, 1, 1))
        for j, sign in ((16, -1), (17, 1)):
            R[:, j] = upright @ Rotation.from_euler("y", sign * 80, degrees=True).as_matrix()
            R[:, j + 2] = R[:, j + 4] = R[:, j]
        joints = forward_kinematics(body, torch.from_numpy(root), torch.from_numpy(R)).numpy()
        quaternions = Rotation.from_matrix((R @ AXES.T).reshape(-1, 3, 3)).as_quat()
        np.savez(
            tmp_path / f"{name}.npz",
            joint_names=np.array(NAMES),
            joints=joints[:, :22].astype(np.float32),
            joint_rot_global_xyzw=quaternions.reshape(frames, 22, 4).astype(np.float32),
            palms=joints[:, 22:].astype(np.float32),
            obj_pos=joints[:, 22:].mean(axis=1).astype(np.float32),
            obj_rot_xyzw=np.tile([0, 0, 0, 1.0], (frames, 1)).astype(np.float32),
            object=np.array("box"),
            text=np.array("Carry the box."),
            fps=np.array(30),
            up=np.array("z"),
        )
        solid = trimesh.creation.box((0.55, 0.3, 0.3))
        (tmp_path / "meshes").mkdir(exist_ok=True)
        np.savez(tmp_path / "meshes" / "box.npz", vertices=solid.vertices, faces=solid.faces)
        return root, R

    return write
