"""Small motions on the shipped skeleton, and readings of files by others' libraries."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from pygltflib import GLTF2
from scipy.spatial.transform import Rotation

from capture_app.exports.resample import Sampled
from omomo_core.body.kinematics import full_kinematics, joints_of
from omomo_core.body.model import BodyModel, load_body
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
KIND = {5123: np.uint16, 5125: np.uint32, 5126: np.float32}


@pytest.fixture(scope="session")
def shipped(body: BodyModel) -> BodyModel:
    """The shipped skeleton in the small made-up skin: files of it are quick to write."""
    bones = load_body()
    moves = bones.rest_joints - body.rest_joints
    vertices = body.vertices + moves.repeat_interleave(4, dim=0)
    ground = torch.tensor([[0.0, 0.0, 0.0]])
    return replace(
        body,
        rest_joints=bones.rest_joints,
        vertices=torch.cat([vertices, ground]),
        skin_joints=torch.cat([body.skin_joints, torch.zeros(1, 6, dtype=torch.long)]),
        skin_weights=torch.cat([body.skin_weights, torch.tensor([[1.0, 0, 0, 0, 0, 0]])]),
        relaxed_fingers=bones.relaxed_fingers,
    )


def wander(rng: np.random.Generator, frames: int, *shape: int, size: float) -> np.ndarray:
    """Smooth values: (frames, *shape)."""
    t = np.linspace(0, 1, frames).reshape(-1, *(1,) * len(shape))
    return sum(
        rng.normal(0, size / k, shape) * np.sin(k * np.pi * t + rng.uniform(0, 6, shape))
        for k in (1, 2, 3)
    )


def turns(vectors: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*vectors.shape, 3)


Moving = tuple[HumanMotion, ObjectMotion]


@pytest.fixture(scope="session")
def small_motion(shipped: BodyModel) -> Callable[[int], Moving]:
    """A person who stirs, bends and wanders, with a box that tumbles; another one for each seed."""

    def make(seed: int) -> Moving:
        rng = np.random.default_rng(seed)
        frames = int(rng.integers(10, 21))
        yaw = turns(rng.uniform(-3, 3) * np.array([0.0, 0.0, 1.0]))
        R = yaw @ UPRIGHT @ turns(wander(rng, frames, 22, 3, size=0.5))
        root = wander(rng, frames, 3, size=0.5) + np.append(rng.uniform(-3, 3, 2), 0.95)
        person = HumanMotion(
            root=root.astype(np.float32),
            rotations=R.astype(np.float32),
            fingers=turns(wander(rng, frames, 30, 3, size=0.4)).astype(np.float32),
            joints=joints_of(shipped, root, R).astype(np.float32),
            hand_contact=rng.integers(0, 2, (frames, 2)).astype(np.float32),
            foot_contact=rng.integers(0, 2, (frames, 4)).astype(np.float32),
        )
        T = np.tile(np.eye(4), (frames, 1, 1))
        T[:, :3, :3] = turns(wander(rng, frames, 3, size=1.0))
        T[:, :3, 3] = wander(rng, frames, 3, size=0.5) + np.array([0, 0, 1])
        mesh = ObjectMesh(rng.normal(0, 0.2, (6, 3)), np.array([[0, 1, 2], [3, 4, 5]]), "thing")
        return person, ObjectMotion(mesh, T, np.ones(frames, bool))

    return make


Joints = Callable[[Sampled], np.ndarray]


@pytest.fixture(scope="session")
def true_joints(shipped: BodyModel) -> Joints:
    """All 52 joints by the core's own kinematics: (frames, 52, 3), world z up."""

    def place(sampled: Sampled) -> np.ndarray:
        human = sampled.human
        parts = (torch.from_numpy(x).double() for x in (human.root, human.rotations, human.fingers))
        return full_kinematics(shipped, *parts)[0].numpy()

    return place


@dataclass
class GlbReader:
    """A GLB by pygltflib and the specification: accessors, and the node tree at each key frame."""

    gltf: GLTF2

    def __post_init__(self) -> None:
        self.blob = self.gltf.binary_blob()
        self.names = {node.name: i for i, node in enumerate(self.gltf.nodes)}

    def array(self, index: int) -> np.ndarray:
        accessor = self.gltf.accessors[index]
        view = self.gltf.bufferViews[accessor.bufferView]
        width = WIDTH[accessor.type]
        flat = np.frombuffer(
            self.blob, KIND[accessor.componentType], accessor.count * width, view.byteOffset
        )
        return flat.reshape(accessor.count, width)

    def track(self, node: int, path: str) -> np.ndarray:
        (animation,) = self.gltf.animations
        (channel,) = [
            c for c in animation.channels if c.target.node == node and c.target.path == path
        ]
        return self.array(animation.samplers[channel.sampler].output).astype(float)

    def times(self) -> np.ndarray:
        (animation,) = self.gltf.animations
        return self.array(animation.samplers[0].input)[:, 0]

    def local(self, i: int, animated: bool, frames: int) -> np.ndarray:
        """Local matrices of a node over the clip: (frames, 4, 4)."""
        node = self.gltf.nodes[i]
        (animation,) = self.gltf.animations
        moved = {c.target.path for c in animation.channels if c.target.node == i and animated}
        rotation = np.tile(node.rotation or [0, 0, 0, 1], (frames, 1))
        translation = np.tile(node.translation or [0, 0, 0], (frames, 1))
        rotation = self.track(i, "rotation") if "rotation" in moved else rotation
        translation = self.track(i, "translation") if "translation" in moved else translation
        T = np.tile(np.eye(4), (frames, 1, 1))
        T[:, :3, :3] = Rotation.from_quat(rotation).as_matrix()
        T[:, :3, 3] = translation
        return T

    def world(self, name: str, animated: bool = True, frames: int = 1) -> np.ndarray:
        i = self.names[name]
        T = self.local(i, animated, frames)
        while True:
            parents = [k for k, node in enumerate(self.gltf.nodes) if i in node.children]
            if not parents:
                return T
            (i,) = parents
            T = self.local(i, animated, frames) @ T


@pytest.fixture(scope="session")
def read_glb() -> Callable[[Path], GlbReader]:
    return lambda path: GlbReader(GLTF2().load_binary(str(path)))
