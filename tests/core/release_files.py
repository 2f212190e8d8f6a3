"""Files in the exact layout of the OMOMO release: what joblib writes, random people and objects in it."""

import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.body.model import load_body
from omomo_core.skeleton import MODEL_PARENTS, PALM_JOINTS
from tests.core.rig_files import stepping

SIZE, TRANS2JOINT = 1.05, np.array([-0.0014, 0.3947, -0.0132])
TWO_PARTS = ("mop", "vacuum")


class NumpyArrayWrapper:
    """What joblib pickles in place of an array; the bytes follow in the stream."""

    def __init__(self, array: np.ndarray, *, padded: bool) -> None:
        self.subclass, self.shape, self.dtype = np.ndarray, array.shape, array.dtype
        self.order, self.allow_mmap = "C", True
        if padded:
            self.numpy_array_alignment_bytes = 16


NumpyArrayWrapper.__module__ = "joblib.numpy_pickle"


class JoblibPickler(pickle._Pickler):  # pyright: ignore[reportPrivateUsage]
    """Writes as joblib.dump does (its class names are not importable here, hence save_global)."""

    padded = True

    def save(self, obj: Any, save_persistent_id: bool = True) -> None:
        if not isinstance(obj, np.ndarray):
            super().save(obj, save_persistent_id)
            return
        super().save(NumpyArrayWrapper(obj, padded=self.padded))
        self.framer.commit_frame(force=True)
        if self.padded:
            gap = 16 - (self._file.tell() + 1) % 16
            self._file.write(bytes([gap]) + b"\xff" * gap)
        self._file.write(obj.tobytes())

    def save_global(self, obj: Any, name: str | None = None) -> None:
        if obj is NumpyArrayWrapper:
            self.save("joblib.numpy_pickle")
            self.save("NumpyArrayWrapper")
            self.write(pickle.STACK_GLOBAL)
            self.memoize(obj)
        else:
            super().save_global(obj, name)

    dispatch = {**pickle._Pickler.dispatch, type: save_global}  # noqa: RUF012


def dump(path: Path, content: object, *, padded: bool = True) -> Path:
    with path.open("wb") as file:
        pickler = JoblibPickler(file, protocol=4)
        pickler.padded, pickler._file = padded, file  # pyright: ignore
        pickler.dump(content)
    return path


def sequence(name: str = "sub3_largebox_001", frames: int = 120) -> dict[str, Any]:
    """Somebody 5 % larger than we walks with a box between the hands."""
    body = load_body()
    root, pose = stepping(frames)
    rest = body.rest_joints.double().numpy()
    at = np.concatenate([rest[:22], rest[list(PALM_JOINTS)]]) * SIZE
    offsets = at - at[[max(p, 0) for p in MODEL_PARENTS]]
    R = Rotation.from_rotvec(pose[:, 0]).as_matrix()
    middle = root * SIZE + R @ np.array([0.0, 0.1, 0.4])
    return {
        "seq_name": name,
        "betas": np.zeros((1, 16)),
        "gender": np.str_("male"),
        "trans": root * SIZE + TRANS2JOINT,
        "root_orient": pose[:, 0],
        "pose_body": pose[:, 1:].reshape(frames, 63),
        "rest_offsets": offsets,
        "trans2joint": TRANS2JOINT,
        "obj_trans": middle[:, :, None],
        "obj_rot": R,
        "obj_scale": np.full(frames, 0.01),
        "obj_com_pos": middle,
    }


@dataclass(frozen=True)
class Written:
    """What somebody made up, and where everything is because of it, by formulas of its own."""

    entry: dict[str, Any]
    """As the release stores it."""
    joints: np.ndarray
    """(T, 24, 3)."""
    vertices: np.ndarray
    """Of the object, all parts, (T, V, 3)."""


def make_up(rng: np.random.Generator, name: str, folder: Path, frames: int = 30) -> Written:
    """Random bones, poses and object motion; the object's meshes go into ``captured_objects``."""
    rest = load_body().rest_joints.double().numpy()
    at = np.concatenate([rest[:22], rest[list(PALM_JOINTS)]])
    offsets = at - at[[max(p, 0) for p in MODEL_PARENTS]]
    # Both sides alike, as in a body of SMPL-X; turned a little, for rest poses differ.
    offsets = offsets * rng.uniform(0.85, 1.15, (24, 1)) + rng.normal(0, 0.004, (24, 3))
    local = _smooth(rng, frames, 22, 0.3)
    local[:, 0] += Rotation.from_euler("ZX", [rng.uniform(-3, 3), np.pi / 2]).as_rotvec()
    pelvis = np.cumsum(rng.normal(0, 0.01, (frames, 3)), axis=0)
    pelvis[:, 2] += 0.95
    origin = rng.normal(0, 0.2, 3)
    entry = {
        "seq_name": name,
        "betas": rng.normal(size=(1, 16)),
        "gender": str(rng.choice(["male", "female"])),
        "trans": pelvis + origin,
        "root_orient": local[:, 0],
        "pose_body": local[:, 1:].reshape(frames, 63),
        "rest_offsets": np.concatenate([pelvis[:1], offsets[1:]]),
        "trans2joint": origin,
    }
    parts = ("top", "bottom") if name.split("_")[1] in TWO_PARTS else ("",)
    turns = Rotation.from_rotvec(_smooth(rng, frames, 1, 1.0)[:, 0])
    way = pelvis + rng.normal(0, 0.3, 3)
    vertices = []
    for part, key in zip(parts, ("obj", "obj_bottom"), strict=False):
        mesh = trimesh.creation.box(rng.uniform(20, 60, 3)).subdivide()
        mesh.apply_translation(rng.normal(0, 15, 3))
        ending = f"_{part}" if part else ""
        (folder / "captured_objects").mkdir(exist_ok=True)
        mesh.export(
            folder / f"captured_objects/{name.split('_')[1]}_cleaned_simplified{ending}.obj"
        )
        # The lower part is fixed to the upper one, but has axes, origin and unit of its own.
        joint_turn, joint_way = Rotation.random(rng=rng), rng.normal(0, 0.2, 3)
        R = (turns * joint_turn).as_matrix()
        t = way + turns.apply(joint_way)
        scale = np.full(frames, rng.uniform(0.005, 0.01))
        entry |= {f"{key}_trans": t[:, :, None], f"{key}_rot": R, f"{key}_scale": scale}
        vertices.append(scale[:, None, None] * mesh.vertices @ R.swapaxes(1, 2) + t[:, None])
    entry["obj_com_pos"] = vertices[0].mean(axis=1)
    return Written(entry, _walked(pelvis, local, offsets), np.concatenate(vertices, axis=1))


def slipped(entry: dict[str, Any], first: int, last: int, metres: float) -> dict[str, Any]:
    """The same sequence with the lower part elsewhere in some frames."""
    way = entry["obj_bottom_trans"].copy()
    way[first:last, 2] += metres
    return {**entry, "obj_bottom_trans": way}


def _smooth(rng: np.random.Generator, frames: int, count: int, size: float) -> np.ndarray:
    a, b = rng.normal(0, size, (2, 1, count, 3))
    return a + b * np.sin(np.linspace(0, 3, frames))[:, None, None]


def _walked(pelvis: np.ndarray, local: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Joints by following each one's own chain to the root, not by the code under test."""
    joints = np.zeros((len(pelvis), 24, 3))
    for j in range(24):
        chain, at = [], j
        while at > 0:
            chain.append(at)
            at = MODEL_PARENTS[at]
        turn = Rotation.from_rotvec(local[:, 0])
        joints[:, j] = pelvis
        for step in reversed(chain):
            joints[:, j] += turn.apply(offsets[step])
            if step < 22:
                turn = turn * Rotation.from_rotvec(local[:, step])
    return joints
