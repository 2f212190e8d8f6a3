"""A person who carries a box along a bend, as a result folder."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.comparison.compared_motions import Motion
from capture_app.manifest import (
    MANIFEST,
    MOTION,
    BodyRecord,
    FloorRecord,
    Manifest,
    Segment,
    write_manifest,
)
from capture_app.result import save_motion
from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import load_body
from omomo_core.generation.person import Person
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion

FRAMES = 60
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def carrying(*, aside: float = 0.0, size: float | None = None, frames: int = FRAMES) -> Motion:
    """Arms forward, both palms on the sides of a box that is lifted and carried along a bend.

    `aside` moves the person, not the box, to their left; `size` is the box's width, else palms are 2 cm
    off its sides.
    """
    body, t = load_body(), np.linspace(0.0, 1.0, frames)
    turn = Rotation.from_rotvec(np.outer(0.9 * t**2, [0, 0, 1])).as_matrix()
    R = np.tile(UPRIGHT, (frames, 22, 1, 1))
    for j, sign in ((16, -1), (17, 1)):
        R[:, j] = UPRIGHT @ Rotation.from_euler("y", sign * 80, degrees=True).as_matrix()
        R[:, j + 2] = R[:, j + 4] = R[:, j]
    R = turn[:, None] @ R
    height = float(body.rest_joints[0, 1] - body.vertices[:, 1].min())
    root = np.stack([0.8 * t, 0.3 * np.sin(3 * t), np.full(frames, height)], axis=1)
    joints = forward_kinematics(body, torch.from_numpy(root), torch.from_numpy(R)).numpy()
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, :3, :3] = turn
    T[:, :3, 3] = joints[:, 22:].mean(axis=1)
    away = turn @ [aside, 0.0, 0.0]
    fingers = np.tile(body.relaxed_fingers.double().numpy(), (frames, 1, 1, 1))
    held = np.ones((frames, 2), bool)
    human = HumanMotion(
        root + away, R, fingers, joints + away[:, None], held * 1.0, np.ones((frames, 4))
    )
    gap = float(np.linalg.norm(joints[0, 22] - joints[0, 23]))
    box = trimesh.creation.box((size or gap - 0.04, 0.3, 0.3))
    mesh = ObjectMesh(np.array(box.vertices), np.array(box.faces), "box")
    moved = ObjectMotion(mesh, T, np.ones(frames, bool))
    return Motion("carrying", human, moved, body, held)


WriteResult = Callable[..., Path]


def put_result(folder: Path, *motions: Motion, chosen: int = 0) -> Path:
    """Write motions of one box as the samples of a result folder."""
    folder.mkdir(parents=True)
    frames = len(motions[0].human.root)
    people = [Person(m.human, (), np.zeros((frames, 2)), np.zeros(frames)) for m in motions]
    save_motion(folder / MOTION, people, chosen, motions[0].object_motion, "anny")
    manifest = Manifest(
        inputs=(),
        options={},
        segment=Segment(index=1, count=1, start=0, stop=frames),
        floor=FloorRecord(height=0.0, source="given"),
        mount_method="none",
        body=BodyRecord(name="anny", credit="", height=load_body().height),
        weights={},
        scores=tuple({} for _ in motions),
        chosen=chosen,
        notes=(),
        faults=(),
        timings={},
        files=(),
    )
    write_manifest(folder / MANIFEST, manifest)
    return folder


@pytest.fixture
def write_result(tmp_path: Path) -> WriteResult:
    """Writes a result folder of some name in the test's own."""
    return lambda name, *motions, **rest: put_result(tmp_path / name, *motions, **rest)
