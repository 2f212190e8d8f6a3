"""Small motions on the shipped skeleton, a small humanoid, and readings of files by others' libraries."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from pygltflib import GLTF2
from scipy.spatial.transform import Rotation

from capture_app.commands.run import RunRequest
from capture_app.exports.resample import Sampled
from capture_app.pipeline import run_take
from capture_app.result import Result
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
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


LEG = (("hip_yaw", "0 0 1"), ("hip_roll", "1 0 0"), ("hip_pitch", "0 1 0"))
ARM = (("shoulder_pitch", "0 1 0"), ("shoulder_roll", "1 0 0"), ("shoulder_yaw", "0 0 1"))
HAND = (("wrist_roll", "1 0 0"), ("wrist_pitch", "0 1 0"), ("wrist_yaw", "0 0 1"))


def joints(side: str, some: tuple[tuple[str, str], ...]) -> str:
    return "".join(f'<joint name="{side}_{n}" axis="{axis}" range="-2.6 2.6"/>' for n, axis in some)


def limbs(side: str, y: float) -> tuple[str, str]:
    capsule = '<geom type="capsule" size=".03" fromto="0 0 -.05 0 0 {}"/>'
    leg = f"""<body name="{side}_thigh" pos="0 {y} -.1">{joints(side, LEG)}{capsule.format(-0.25)}
      <body name="{side}_shank" pos="0 0 -.33"><joint name="{side}_knee" axis="0 1 0" range="0 2.6"/>
      {capsule.format(-0.25)}<body name="{side}_foot" pos="0 0 -.33">
      {joints(side, (("ankle_pitch", "0 1 0"), ("ankle_roll", "1 0 0")))}
      <geom type="box" size=".09 .04 .01" pos=".03 0 -.04"/></body></body></body>"""
    arm = f"""<body name="{side}_arm" pos="0 {2 * y} .4">{joints(side, ARM)}{capsule.format(-0.2)}
      <body name="{side}_elbow" pos="0 0 -.26"><joint name="{side}_elbow" axis="0 1 0" range="-2.6 .3"/>
      <geom type="capsule" size=".025" fromto=".05 0 0 .18 0 0"/>
      <body name="{side}_hand" pos=".22 0 0">{joints(side, HAND)}
      <geom type="box" size=".05 .015 .03" pos=".06 0 0"/></body></body></body>"""
    return leg, arm


@pytest.fixture(scope="session")
def humanoid(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The model and the map of a humanoid of 26 joints whose legs are 66 cm long."""
    folder = tmp_path_factory.mktemp("humanoid")
    (left_leg, left_arm), (right_leg, right_arm) = limbs("left", 0.1), limbs("right", -0.1)
    model = folder / "humanoid.xml"
    model.write_text(f"""<mujoco><compiler angle="radian"/><worldbody><body name="hips" pos="0 0 .8">
      <freejoint/><geom type="box" size=".06 .08 .05"/>{left_leg}{right_leg}
      <body name="trunk" pos="0 0 .05"><joint name="waist" axis="0 0 1" range="-2 2"/>
      <joint name="bow" axis="0 1 0" range="-.5 .9"/><geom type="box" size=".07 .1 .2" pos="0 0 .2"/>
      {left_arm}{right_arm}</body></body></worldbody></mujoco>""")
    both = {
        f"{side}_{part}": {"body": f"{side}_{body}", "point": [x, 0, 0]}
        for side in ("left", "right")
        for part, body, x in (("foot", "foot", 0), ("palm", "hand", 0.08), ("elbow", "elbow", 0))
    }
    frames = folder / "frames.json"
    chosen: dict[str, Any] = {
        "pelvis": {"body": "hips"},
        "torso": {"body": "trunk"},
        **both,
        "sole": 0.05,
    }
    chosen |= {"arms": ["left_arm", "right_arm"], "legs": ["left_thigh", "right_thigh"]}
    chosen["stance"] = {f"{s}_knee": 0.5 for s in ("left", "right")}
    frames.write_text(json.dumps(chosen))
    return model, frames


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """The demonstration take."""
    request = RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        output=tmp_path_factory.mktemp("demo") / "result",
        samples=1,
        steps=5,
        video_size=None,
    )
    return run_take(request)
