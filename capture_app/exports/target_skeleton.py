"""A skeleton that shall carry the motion, read from BVH, GLB (VRM among them) or SMPL-X files."""

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from pygltflib import GLTF2, Node
from scipy.spatial.transform import Rotation

from capture_app.blender_extension.bone_names import BONE_NAMES, NAMED_AS, NEEDED, recognised
from capture_app.commands.export import Bones
from capture_app.exports.bones import standing_shift
from capture_app.exports.exported_take import Y_UP, Skeleton
from omomo_core.body.model import BodyModel, load_body
from omomo_core.errors import InputError, in_words
from omomo_core.learning.recordings.bvh_file import read_bvh
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS

_SOLE = 0.034
"""Height of the lowest joint of a foot over the sole, as a part of the leg's length."""
_ON_FLOOR = 0.25
"""Part of the leg's length: a lowest joint that near above the file's origin stands on its floor."""


@dataclass(frozen=True)
class Character:
    """A GLB or VRM with a skin, which can carry the motion itself."""

    gltf: GLTF2
    scene: dict[str, Any]
    """JSON of the file, with what `gltf` does not know."""
    nodes: tuple[int, ...]
    """Node of each joint of the skeleton."""
    metres: float
    """Factor that brings its scene to metres."""


@dataclass(frozen=True)
class Target:
    """A skeleton standing at rest in our world."""

    name: str
    skeleton: Skeleton
    joints: dict[str, int]
    """Our joint -> index of theirs; those of NEEDED at least."""
    smplx: BodyModel | None = None
    """The SMPL-X model that it was made of."""
    character: Character | None = None
    """The file, if it has a skin of its own."""


@dataclass(frozen=True)
class RawBones:
    """Bones as a file has them, in its axes."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: Float[np.ndarray, "joints 3"]
    """At rest, any unit."""
    rotations: Float[np.ndarray, "joints 3 3"]
    """At rest, from the joint's axes to the file's."""


def standing(name: str, bones: RawBones, joints: Mapping[str, int], where: str) -> Target:
    """A file's bones put upright on the floor of our world, facing -y, in metres.

    Args:
        name: what to call the target.
        bones: at rest the body stands, arms in any direction.
        joints: our joint -> bone.
        where: the file, for messages.

    Raises:
        InputError: "skeleton-unknown" when needed bones were not found, "skeleton-not-standing".
    """
    missing = [ours for ours in NEEDED if ours not in joints]
    if missing:
        raise InputError(
            "skeleton-unknown",
            f"The skeleton lacks a bone for {', '.join(missing[:4])}"
            + (f" and {len(missing) - 4} more." if len(missing) > 4 else "."),
            where=where,
            fix=f"Name its bones as {NAMED_AS} names them; a VRM file says itself.",
        )
    at = {ours: bones.positions[k] for ours, k in joints.items()}
    R = Y_UP.T @ _upright(at, where).T
    leg = _leg(at)
    metres = _metres(leg)
    points = bones.positions @ R.T
    lowest = points[[joints[k] for k in joints if k.endswith(("ankle", "foot"))], 2].min()
    floor = 0.0 if 0.0 < lowest < _ON_FLOOR * leg else lowest - _SOLE * leg
    pelvis = points[joints["pelvis"]]
    points = (points - [pelvis[0], pelvis[1], floor]) * metres
    skeleton = Skeleton(bones.names, bones.parents, points, R @ bones.rotations, joints["pelvis"])
    return Target(name, skeleton, dict(joints))


def _metres(leg: float) -> float:
    """Return the factor from a file's unit to metres, by the length of a leg."""
    return 0.01 if leg > 10.0 else 1.0


def _leg(at: Mapping[str, Float[np.ndarray, "3"]]) -> float:
    bones = (("left_hip", "left_knee"), ("left_knee", "left_ankle"))
    return sum(float(np.linalg.norm(at[b] - at[a])) for a, b in bones)


def _upright(at: Mapping[str, Float[np.ndarray, "3"]], where: str) -> Float[np.ndarray, "3 3"]:
    """Columns: left, up and forward of a standing body in the file's axes."""
    feet = (at["left_ankle"] + at["right_ankle"]) / 2
    up = _snapped(at["head"] - feet)
    left = at["left_hip"] - at["right_hip"]
    left = _snapped(left - up * (left @ up))
    knees = [(at[f"{s}_hip"] - at[f"{s}_ankle"]) @ up / _leg(at) for s in ("left", "right")]
    if min(knees) < 0.7 or not np.isfinite(left).all():
        raise InputError(
            "skeleton-not-standing",
            "In its rest pose the skeleton does not stand upright, so there is nothing to compare "
            "with.",
            where=where,
            fix="Export it again with a T-pose or an A-pose as the rest pose.",
        )
    return np.stack([left, up, np.cross(left, up)], axis=1)


def _snapped(v: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """A direction of unit length; the axis that is nearly it, if one is."""
    v = v / max(float(np.linalg.norm(v)), 1e-12)
    axis = np.zeros(3)
    axis[np.abs(v).argmax()] = np.sign(v[np.abs(v).argmax()])
    return axis if v @ axis > 0.97 else v


def read_target(path: Path) -> Target:
    """Read the skeleton that a motion shall be put on.

    Args:
        path: BVH (its offsets are the rest pose; centimetres or metres, by the legs' length), GLB or
            VRM (the nodes' own poses are), or a SMPL-X model such as SMPLX_NEUTRAL.npz.

    Raises:
        InputError: "skeleton-unreadable", "skeleton-unknown", "skeleton-not-standing", or what the
            BVH reader says.
        AssetError: a damaged SMPL-X file.
    """
    if path.suffix.lower() == ".npz":
        return _smplx(path)
    if path.suffix.lower() == ".bvh":
        bones = _bvh(path)
        return standing(path.stem, bones, recognised(bones.names), str(path))
    return _glb(path)


def _smplx(path: Path) -> Target:
    body = load_body(path)
    points = (body.rest_joints.double().numpy() + standing_shift(body)) @ Y_UP
    upright = np.tile(Y_UP.T, (len(points), 1, 1))
    skeleton = Skeleton(ALL_JOINTS, ALL_PARENTS, points, upright, hips=0)
    return Target(body.name, skeleton, {n: j for j, n in enumerate(ALL_JOINTS)}, body)


def _bvh(path: Path) -> RawBones:
    read = read_bvh(path, metres_per_unit=1.0)
    names = read.names
    kept = [j for j, p in enumerate(read.parents) if p < 0 or names[j] != f"{names[p]}_end"]
    index = {j: k for k, j in enumerate(kept)}
    return RawBones(
        names=tuple(names[j] for j in kept),
        parents=tuple(index.get(read.parents[j], -1) for j in kept),
        positions=read.rest[kept],
        rotations=np.tile(np.eye(3), (len(kept), 1, 1)),
    )


def _glb(path: Path) -> Target:
    gltf = _loaded(path)
    children = {c: n for n, node in enumerate(gltf.nodes) for c in node.children or []}
    named = _humanoid(gltf) or recognised(_bone_names(gltf))
    kept = _bones(gltf, children, set(named.values()))
    index = {n: k for k, n in enumerate(kept)}
    T = np.stack([global_pose(gltf, children, n) for n in kept]) if kept else np.zeros((0, 4, 4))
    sizes = np.linalg.norm(T[:, :3, :3], axis=1, keepdims=True)
    bones = RawBones(
        names=tuple(gltf.nodes[n].name or f"bone_{n}" for n in kept),
        parents=tuple(index.get(children.get(n, -1), -1) for n in kept),
        positions=T[:, :3, 3],
        rotations=T[:, :3, :3] / np.maximum(sizes, 1e-12),
    )
    joints = {ours: index[n] for ours, n in named.items() if n in index}
    target = standing(path.stem, bones, joints, str(path))
    # An export of ours is no character: its body and object would stand beside the new ones.
    if not gltf.skins or (gltf.asset.generator or "").startswith("omocap"):
        return target
    leg = _leg({ours: bones.positions[k] for ours, k in joints.items()})
    return replace(target, character=Character(gltf, _json_of(path), tuple(kept), _metres(leg)))


def _json_of(path: Path) -> dict[str, Any]:
    """Return the JSON of a binary glTF that was read before."""
    with path.open("rb") as file:
        (length,) = struct.unpack("<12xI4x", file.read(20))
        return json.loads(file.read(length))


def _bone_names(gltf: GLTF2) -> list[str]:
    """Names of the nodes; "" for those that cannot be bones, where skins say which are."""
    skinned = {j for skin in gltf.skins or [] for j in skin.joints or []}
    nodes = enumerate(gltf.nodes)
    return [(node.name or "") if k in skinned or not skinned else "" for k, node in nodes]


def _loaded(path: Path) -> GLTF2:
    try:
        with path.open("rb") as file:
            if file.read(4) != b"glTF":
                raise ValueError("it is no binary glTF")
        gltf = GLTF2.load_binary(str(path))
        if gltf is None:
            raise ValueError("it is empty")
        return gltf
    except Exception as error:  # damaged JSON and chunks fail in a dozen ways
        raise InputError(
            "skeleton-unreadable",
            f"No skeleton can be read here: {in_words(error)}.",
            where=str(path),
            fix="Give a BVH, GLB or VRM file of the character, or a SMPL-X model (.npz).",
        ) from error


def _humanoid(gltf: GLTF2) -> dict[str, int]:
    """Our joint -> node, as a VRM 1.0 file says."""
    extension = (gltf.extensions or {}).get("VRMC_vrm", {})
    bones = extension.get("humanoid", {}).get("humanBones", {})
    names = BONE_NAMES[Bones.vrm].of
    return {ours: bones[n]["node"] for ours, n in names.items() if n in bones}


def _bones(gltf: GLTF2, parents: dict[int, int], human: set[int]) -> list[int]:
    """Nodes of the skeleton, parents first: the human's bones, what skins are tied to, and between."""
    skinned = {j for skin in gltf.skins or [] for j in skin.joints or []}
    nodes = human | skinned
    if not human:
        return []
    top = min(human)
    for n in sorted(human):
        common = set(_path(parents, n))
        top = next((k for k in _path(parents, top) if k in common), top)
    # Above the person's bones stand those of the skin, such as a root on the floor, and then the scene.
    above = [k for k in _path(parents, top) if k in skinned or not skinned]
    top = above[-1] if above else top
    inside = {k for n in nodes for k in _path(parents, n) if top in _path(parents, k)}
    return sorted(inside, key=lambda n: (len(_path(parents, n)), n))


def _path(parents: dict[int, int], node: int) -> list[int]:
    """A node and all above it."""
    path = [node]
    while path[-1] in parents:
        path.append(parents[path[-1]])
    return path


def global_pose(gltf: GLTF2, parents: dict[int, int], node: int) -> Float[np.ndarray, "4 4"]:
    """Return the rest pose of a node in the file's world; `parents` are nodes by their children."""
    chain = [local_pose(gltf.nodes[n]) for n in reversed(_path(parents, node))]
    return reduce(np.matmul, chain)


def local_pose(node: Node) -> Float[np.ndarray, "4 4"]:
    """Return the rest pose of a node against the one that it hangs on, scale included."""
    if node.matrix is not None:
        return np.array(node.matrix, float).reshape(4, 4).T
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(node.rotation or [0.0, 0.0, 0.0, 1.0]).as_matrix()
    T[:3, :3] *= np.array(node.scale or [1.0, 1.0, 1.0])
    T[:3, 3] = node.translation or [0.0, 0.0, 0.0]
    return T
