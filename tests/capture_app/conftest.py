"""A small made-up body and motion: the tests of the app need no shipped assets."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.commands.run import RunRequest
from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.person import Person
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from omomo_core.skeleton import ALL_PARENTS
from omomo_core.stages import body_capture as body_stage
from omomo_core.stages import hands_capture as hand_stage
from omomo_core.stages.network_file import save_network
from omomo_core.stages.stage import Stage

FRAMES = 40


def _rest_joints(rng: np.random.Generator) -> np.ndarray:
    rest = np.zeros((52, 3))
    rest[0] = [0.02, 0.95, -0.03]
    for j in range(1, 52):
        rest[j] = rest[ALL_PARENTS[j]] + rng.normal(0.0, 0.12, 3)
    return rest


@pytest.fixture(scope="session")
def body() -> BodyModel:
    """A tetrahedron around every joint, each vertex moved by six bones."""
    rng = np.random.default_rng(1)
    rest = _rest_joints(rng)
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.05
    vertices = (rest[:, None] + corner).reshape(-1, 3)
    face = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    faces = (np.arange(52)[:, None, None] * 4 + face).reshape(-1, 3)
    weights = rng.dirichlet(np.full(6, 0.4), len(vertices))
    return BodyModel(
        name="tetra",
        credit="Nobody, CC0",
        rest_joints=torch.tensor(rest, dtype=torch.float32),
        vertices=torch.tensor(vertices, dtype=torch.float32),
        faces=torch.tensor(faces),
        skin_joints=torch.tensor(rng.integers(0, 52, (len(vertices), 6))),
        skin_weights=torch.tensor(weights, dtype=torch.float32),
        relaxed_fingers=torch.eye(3).expand(30, 3, 3).contiguous(),
    )


def smooth_rotations(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Rotations that turn more than once around over the frames: (frames, *shape, 3, 3)."""
    axis = rng.normal(size=(*shape, 3))
    speed = np.linspace(0.0, 2.5 * np.pi, FRAMES).reshape(-1, *(1,) * len(shape), 1)
    turns = Rotation.from_rotvec((axis * speed).reshape(-1, 3)).as_matrix()
    return turns.reshape(FRAMES, *shape, 3, 3)


def make_human(body: BodyModel, seed: int) -> HumanMotion:
    rng = np.random.default_rng(seed)
    root = np.cumsum(rng.normal(0, 0.02, (FRAMES, 3)), axis=0).astype(np.float32)
    rotations = smooth_rotations(rng, 22).astype(np.float32)
    joints = forward_kinematics(body, torch.from_numpy(root), torch.from_numpy(rotations))
    return HumanMotion(
        root=root,
        rotations=rotations,
        fingers=smooth_rotations(rng, 30).astype(np.float32),
        joints=joints.numpy(),
        hand_contact=rng.integers(0, 2, (FRAMES, 2)).astype(np.float32),
        foot_contact=rng.integers(0, 2, (FRAMES, 4)).astype(np.float32),
    )


@pytest.fixture(scope="session")
def human(body: BodyModel) -> HumanMotion:
    return make_human(body, 0)


@pytest.fixture(scope="session")
def people(body: BodyModel) -> tuple[Person, ...]:
    """Three samples that hold nothing, one place, and two."""
    rng = np.random.default_rng(3)
    held = [ContactSegment(k % 2, 3 + 9 * k, 9 + 9 * k, rng.normal(size=3)) for k in range(3)]
    return tuple(
        Person(
            make_human(body, k),
            tuple(held[:k]),
            rng.uniform(0, 0.1, (FRAMES, 2)),
            rng.uniform(0, 0.1, FRAMES),
        )
        for k in range(3)
    )


@pytest.fixture(scope="session")
def object_motion() -> ObjectMotion:
    """A box that tumbles over the floor; its frame is not at its centre."""
    rng = np.random.default_rng(7)
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, :3] = smooth_rotations(rng)
    T[:, :3, 3] = np.array([0.4, -0.2, 1.0]) + np.linspace(0, 1, FRAMES)[:, None]
    corners = np.array([[x, y, z] for x in (0, 0.3) for y in (0, 0.2) for z in (0, 0.5)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    valid = np.ones(FRAMES, bool)
    valid[5:8] = False
    return ObjectMotion(ObjectMesh(corners, faces, "box"), T, valid, start_time=1.5)


FAST = {"samples": 2, "steps": 2}


@pytest.fixture(scope="session")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Untrained stages: the motion is nonsense, the way to it is the real one."""
    folder = tmp_path_factory.mktemp("weights")
    torch.manual_seed(0)
    for name, config in (("hands", hand_stage.CONFIG), ("body", body_stage.CONFIG)):
        small = replace(config, denoiser=replace(config.denoiser, layers=1))
        save_network(Stage(small), small, folder / f"{name}.safetensors", {})
    return folder


@dataclass(frozen=True)
class Inputs:
    """Files of one take in a folder of their own."""

    folder: Path

    @property
    def session(self) -> Path:
        return self.folder / "take"

    @property
    def mesh(self) -> Path:
        return self.folder / "box.obj"

    @property
    def mount(self) -> Path:
        return self.folder / "mount.json"

    @property
    def output(self) -> Path:
        return self.folder / "result"

    def write_poses(self, positions: np.ndarray, turns: Rotation, rate: float = 60.0) -> None:
        """An ios_logger session: seconds, x, y, z, qw, qx, qy, qz; ARKit world, y up."""
        q = turns.as_quat()
        times = 1000.0 + np.arange(len(positions)) / rate
        columns = [times, *positions.T, q[:, 3], *q[:, :3].T]
        self.session.mkdir(exist_ok=True)
        np.savetxt(self.session / "ARposes.txt", np.stack(columns, 1), "%.6f", ",")

    def write_mount(self, T_phone_object: np.ndarray) -> None:
        data = {"T_phone_object": T_phone_object.tolist(), "method": "made up"}
        self.mount.write_text(json.dumps(data))

    def request(self, weights: Path) -> RunRequest:
        """A quick run without a video."""
        return RunRequest(
            session=self.session,
            object=self.mesh,
            mount=self.mount,
            output=self.output,
            **FAST,
            weights=weights,
            video_size=None,
        )


@pytest.fixture
def inputs(tmp_path: Path) -> Inputs:
    """Three seconds: the object stands on the floor, is lifted and turned, and put down."""
    made = Inputs(tmp_path)
    clock = np.linspace(0.0, 1.0, 181)
    lift = np.clip(np.sin(np.pi * (2.0 * clock - 0.5)), 0.0, None)
    # Noise of a live tracker, without which the log looks frozen.
    noise = np.random.default_rng(0).normal(0.0, 1e-4, (181, 3))
    positions = np.stack([0.3 * lift, 0.4 * lift - 1.0, -0.2 * lift], axis=1) + noise
    made.write_poses(positions, Rotation.from_rotvec(np.outer(lift, [0.0, 0.8, 0.1])))
    made.write_mount(np.eye(4))
    # The phone stands on top of the box.
    box = trimesh.creation.box((0.4, 0.5, 0.3))
    box.apply_translation((0.0, -0.32, 0.0)).export(made.mesh)
    return made
