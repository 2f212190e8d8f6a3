"""Six characters of others: naming styles, proportions and rest poses, as GLB files of our own joints.

Each has what real ones have: bones that are none of ours, axes of its own, a node scaled to centimetres,
shoes as a skin. All are made here, from the shipped body's joints.
"""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.blender_extension.bone_names import _KNOWN
from omomo_core.body.model import load_body
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS, FINGER_JOINTS, joint


@dataclass(frozen=True)
class RigKind:
    """What a character is like."""

    names: str
    """Table of bone names."""
    size: float
    """1 is our own."""
    arms: float = 0.0
    """Degrees that the arms hang below a T-pose."""
    scale: float = 1.0
    """Of the node above the bones."""
    fingers: bool = True
    twists: bool = False
    vrm: bool = False
    """Bones have names of no table, and the file says which is which, as VRM 1.0 does."""
    plain: bool = False
    """Names have lost their colon, as three.js writes them."""


KINDS = {
    "mixamo": RigKind("mixamo", 1.0, scale=0.01),
    "unreal": RigKind("unreal", 1.3, arms=45.0, twists=True),
    "vrm": RigKind("vrm", 0.6, vrm=True),
    "rigify": RigKind("rigify", 1.0, arms=30.0, twists=True),
    "three": RigKind("mixamo", 0.6, arms=40.0, fingers=False, plain=True),
    "tall": RigKind("mixamo", 1.3, arms=55.0, scale=0.01, fingers=False),
}


@dataclass(frozen=True)
class Rig:
    """A character at rest: y up, facing +z, metres, soles on y = 0."""

    kind: RigKind
    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: np.ndarray
    rotations: np.ndarray
    """(joints, 3, 3), from the bone's axes to the file's."""
    joints: dict[str, int]
    """Our joint -> bone."""
    palms: np.ndarray
    """(2, 3) where the bases of the middle fingers are, though there may be no fingers."""
    soles: dict[str, np.ndarray]
    """Our joint -> the point of the sole below it."""


def make_rig(kind: RigKind) -> Rig:
    """The character of a kind, always the same."""
    rest = load_body().rest_joints.double().numpy()
    lowest = load_body().vertices[:, 1].min().item()
    points = (rest - [rest[0, 0], lowest, rest[0, 2]]) * kind.size
    points = _arms_down(points, kind.arms)
    kept = [j for j, name in enumerate(ALL_JOINTS) if kind.fingers or name not in FINGER_JOINTS]
    table = _KNOWN[kind.names]
    names = [table[ALL_JOINTS[j]] for j in kept]
    parents = [kept.index(ALL_PARENTS[j]) if j else -1 for j in kept]
    joints = {ALL_JOINTS[j]: k for k, j in enumerate(kept)}
    positions = [points[j] for j in kept]
    if kind.twists:
        names, parents, positions, joints = _with_twists(names, parents, positions, joints)
    if kind.vrm:
        names = [f"J_Bip_{k}" for k in range(len(names))]
    if kind.plain:
        names = [name.replace(":", "") for name in names]
    ankles = {name: points[joint(name)] for name in ("left_ankle", "right_ankle")}
    toes = {name: points[joint(name)] for name in ("left_foot", "right_foot")}
    return Rig(
        kind, tuple(names), tuple(parents), np.array(positions),
        _axes(np.array(positions), parents), joints,
        points[[joint("left_middle1"), joint("right_middle1")]],
        {name: at * [1.0, 0.0, 1.0] for name, at in (ankles | toes).items()},
    )  # fmt: skip


def _arms_down(points: np.ndarray, degrees: float) -> np.ndarray:
    out = points.copy()
    for side, sign in (("left", -1.0), ("right", 1.0)):
        top = points[joint(f"{side}_shoulder")]
        turn = Rotation.from_euler("z", sign * degrees, degrees=True).as_matrix()
        parts = ("elbow", "wrist", *(n.removeprefix(f"{side}_") for n in FINGER_JOINTS))
        for name in (f"{side}_{part}" for part in parts):
            if name in ALL_JOINTS:
                out[joint(name)] = top + turn @ (points[joint(name)] - top)
    return out


def _with_twists(
    names: list[str], parents: list[int], positions: list[np.ndarray], joints: dict[str, int]
) -> tuple[list[str], list[int], list[np.ndarray], dict[str, int]]:
    """A root above all, and a bone in the middle of each upper arm, on which the elbow hangs."""
    names, parents = ["root", *names], [-1, *(p + 1 for p in parents)]
    positions = [np.zeros(3), *positions]
    joints = {ours: k + 1 for ours, k in joints.items()}
    for side in ("left", "right"):
        upper, lower = joints[f"{side}_shoulder"], joints[f"{side}_elbow"]
        names.append(f"{names[upper]}_twist_01")
        positions.append((positions[upper] + positions[lower]) / 2)
        parents.append(upper)
        parents[lower] = len(names) - 1
    return names, parents, positions, joints


def _axes(positions: np.ndarray, parents: list[int]) -> np.ndarray:
    """Axes along the bones (y), as Blender and Rigify have them, rolled somehow."""
    rng = np.random.default_rng(3)
    out = np.tile(np.eye(3), (len(parents), 1, 1))
    for j in range(len(parents)):
        ends = [positions[k] for k, p in enumerate(parents) if p == j]
        y = ends[0] - positions[j] if ends else positions[j] - positions[max(parents[j], 0)]
        y = y / max(np.linalg.norm(y), 1e-9) if np.any(y) else np.array([0.0, 1.0, 0.0])
        z = np.cross(rng.normal(size=3), y)
        z /= np.linalg.norm(z)
        out[j] = np.stack([np.cross(y, z), y, z], axis=1)
    return out


def write_rig(rig: Rig, path: Path, color: tuple[float, float, float] | None = None) -> Path:
    """Write the character as GLB, with shoes as its skin; with a colour, its bones have boxes, too."""
    nodes: list[dict[str, Any]] = []
    scale = rig.kind.scale
    for j, name in enumerate(rig.names):
        parent = rig.parents[j]
        R = np.eye(3) if parent < 0 else rig.rotations[parent]
        origin = np.zeros(3) if parent < 0 else rig.positions[parent]
        turn = Rotation.from_matrix(R.T @ rig.rotations[j])
        nodes.append({
            "name": name, "translation": (R.T @ (rig.positions[j] - origin) / scale).tolist(),
            "rotation": turn.as_quat().tolist(),
            "children": [k for k, p in enumerate(rig.parents) if p == j],
        })  # fmt: skip
    for node in nodes:
        if not node["children"]:
            del node["children"]
    count = len(nodes)
    nodes.append({"name": "shoes", "mesh": 0, "skin": 0})
    nodes.append({"name": "Armature", "scale": [scale] * 3, "children": [0, count]})
    arrays = _boxes(rig, bones=color is not None)
    accessors, views, data = [], [], b""
    for kind, array in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        code = {"float32": 5126, "uint16": 5123}[array.dtype.name]
        accessor = {"bufferView": len(views) - 1, "componentType": code, "count": len(array)}
        flat = array.reshape(len(array), -1)
        low, high = flat.min(axis=0).tolist(), flat.max(axis=0).tolist()
        accessors.append({**accessor, "type": kind, "min": low, "max": high})
        data += array.tobytes() + b"\0" * (-array.nbytes % 4)
    scene: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [count + 1]}],
        "nodes": nodes, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
        "skins": [{"joints": list(range(count)), "inverseBindMatrices": 4}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}, "indices": 3,
        }]}],
    }  # fmt: skip
    if color is not None:
        scene["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0]}}]
        scene["meshes"][0]["primitives"][0]["material"] = 0
    if rig.kind.vrm:
        table = _KNOWN["vrm"]
        bones = {table[ours]: {"node": k} for ours, k in rig.joints.items()}
        scene["extensionsUsed"] = ["VRMC_vrm"]
        scene["extensions"] = {
            "VRMC_vrm": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}
        }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    whole = 28 + len(text) + len(data)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, whole) + chunks)
    return path


def _boxes(rig: Rig, *, bones: bool) -> list[tuple[str, np.ndarray]]:
    """A box for each foot, 10 cm times the size wide, from the heel to before the toes.

    With `bones`, a box around each bone of at least 5 cm as well.
    """
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = [(0, 1, 3, 0, 3, 2), (4, 6, 7, 4, 7, 5), (0, 4, 5, 0, 5, 1),
             (2, 3, 7, 2, 7, 6), (0, 2, 6, 0, 6, 4), (1, 5, 7, 1, 7, 3)]  # fmt: skip
    boxes = _shoes(rig) + (_around_bones(rig) if bones else [])
    points = [point for low, high, _ in boxes for point in low + corners * (high - low)]
    indices = [8 * k + i for k in range(len(boxes)) for row in faces for i in row]
    moving = [bone for *_, bone in boxes for _ in corners]
    matrices = np.tile(np.eye(4), (len(rig.names), 1, 1))
    R = rig.rotations.swapaxes(1, 2)
    matrices[:, :3, :3] = R / rig.kind.scale
    matrices[:, :3, 3] = -np.einsum("jxy,jy->jx", R, rig.positions) / rig.kind.scale
    joints = np.zeros((len(moving), 4), np.uint16)
    joints[:, 0] = moving
    weights = np.tile(np.array([1, 0, 0, 0], np.float32), (len(moving), 1))
    return [
        ("VEC3", np.array(points, np.float32)),
        ("VEC4", joints),
        ("VEC4", weights),
        ("SCALAR", np.array(indices, np.uint16)),
        ("MAT4", matrices.swapaxes(1, 2).astype(np.float32)),
    ]


def _shoes(rig: Rig) -> list[tuple[np.ndarray, np.ndarray, int]]:
    """Lowest and highest corner of each shoe, and the bone that moves it."""
    boxes = []
    for side in ("left", "right"):
        ankle = rig.positions[rig.joints[f"{side}_ankle"]]
        toe = rig.positions[rig.joints[f"{side}_foot"]]
        low = np.array([ankle[0] - 0.05 * rig.kind.size, 0.0, ankle[2] - 0.05 * rig.kind.size])
        high = np.array([ankle[0] + 0.05 * rig.kind.size, ankle[1], toe[2]])
        boxes.append((low, high, rig.joints[f"{side}_ankle"]))
    return boxes


def _around_bones(rig: Rig) -> list[tuple[np.ndarray, np.ndarray, int]]:
    """Lowest and highest corner of a box around each bone, and the joint at its start."""
    boxes, wide = [], 0.05 * rig.kind.size
    for j, parent in enumerate(rig.parents):
        ends = rig.positions[[parent, j]]
        if parent >= 0 and np.linalg.norm(ends[1] - ends[0]) > wide:
            boxes.append((ends.min(axis=0) - wide, ends.max(axis=0) + wide, parent))
    return boxes
