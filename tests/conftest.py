"""Fixtures shared by every test."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import settings
from scipy.spatial.transform import Rotation
from typer.core import TyperCommand

pytest_plugins = ("call_checks", "quick")

REPO = Path(__file__).resolve().parent.parent

# How long an example takes says nothing on a busy machine.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of third-party data beside the repository; tests that need it skip without it."""
    folder = Path(os.environ.get("OMOCAP_SHARED", REPO.parent / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip("third-party data folder is not there (set OMOCAP_SHARED)")
    return folder


@pytest.fixture(scope="session", autouse=True)
def commands_that_ended():
    """The functions behind all commands that have ended well in this process."""
    from tests.commands import callback_of

    ended: set[object] = set()
    invoke = TyperCommand.invoke

    def watched(self: TyperCommand, ctx: Any) -> Any:
        result = invoke(self, ctx)
        ended.add(callback_of(self))
        return result

    TyperCommand.invoke = watched
    yield ended
    TyperCommand.invoke = invoke


@pytest.fixture(autouse=True)
def runs_its_commands(request: pytest.FixtureRequest, commands_that_ended: set[object]):
    """A test that is marked with a command fails when that command has not ended well."""
    yield
    # A quick run skips the tests of commands that start processes.
    marks = () if request.config.getoption("quick") else request.node.iter_markers("runs")
    for mark in marks:
        if not mark.kwargs.get("elsewhere"):
            from tests.commands import callback_of, commands

            callback = callback_of(commands()[mark.args[0]])
            assert callback in commands_that_ended, f"{mark.args[0]} has not ended well"


WriteClip = Callable[[str], tuple[np.ndarray, np.ndarray]]


@pytest.fixture
def write_clip(tmp_path: Path) -> WriteClip:
    """Writes a clip of our body carrying a box, in the layout that `omocap evaluate` reads.

    It goes to the test's folder under the given name, its mesh beside it; root and rotations as our
    body has them come back.
    """
    from omomo_core.body.kinematics import forward_kinematics
    from omomo_core.body.model import load_body
    from omomo_core.learning.evaluation.real_clips import AXES, NAMES

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
