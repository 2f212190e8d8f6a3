"""Skeletons to move, read from BVH, GLB (VRM among them) and SMPL-X model files."""

from functools import reduce
from pathlib import Path

import numpy as np
from jaxtyping import Float
from pygltflib import GLTF2, Node
from scipy.spatial.transform import Rotation

from capture_app.commands.export import Bones
from capture_app.exports.bone_names import BONE_NAMES
from capture_app.exports.own_bones import standing_shift
from capture_app.exports.take import Y_UP, Skeleton
from capture_app.exports.target import RawBones, Target, recognised, standing
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.recordings.bvh import read_bvh
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS


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
    named = _humanoid(gltf) or recognised([node.name or "" for node in gltf.nodes])
    kept = _bones(gltf, children, set(named.values()))
    index = {n: k for k, n in enumerate(kept)}
    T = np.stack([_global(gltf, children, n) for n in kept]) if kept else np.zeros((0, 4, 4))
    sizes = np.linalg.norm(T[:, :3, :3], axis=1, keepdims=True)
    bones = RawBones(
        names=tuple(gltf.nodes[n].name or f"bone_{n}" for n in kept),
        parents=tuple(index.get(children.get(n, -1), -1) for n in kept),
        positions=T[:, :3, 3],
        rotations=T[:, :3, :3] / np.maximum(sizes, 1e-12),
    )
    joints = {ours: index[n] for ours, n in named.items() if n in index}
    return standing(path.stem, bones, joints, str(path))


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
            f"No skeleton can be read here: {error}.",
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
    wanted = human | {j for skin in gltf.skins or [] for j in skin.joints or []}
    if not human:
        return []
    top = min((_path(parents, n) for n in wanted), key=len)[-1]
    for n in sorted(human):
        common = set(_path(parents, n))
        top = next((k for k in _path(parents, top) if k in common), top)
    inside = {k for n in wanted for k in _path(parents, n) if top in _path(parents, k)}
    return sorted(inside, key=lambda n: (len(_path(parents, n)), n))


def _path(parents: dict[int, int], node: int) -> list[int]:
    """A node and all above it."""
    path = [node]
    while path[-1] in parents:
        path.append(parents[path[-1]])
    return path


def _global(gltf: GLTF2, parents: dict[int, int], node: int) -> Float[np.ndarray, "4 4"]:
    chain = [_local(gltf.nodes[n]) for n in reversed(_path(parents, node))]
    return reduce(np.matmul, chain)


def _local(node: Node) -> Float[np.ndarray, "4 4"]:
    if node.matrix is not None:
        return np.array(node.matrix, float).reshape(4, 4).T
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(node.rotation or [0.0, 0.0, 0.0, 1.0]).as_matrix()
    T[:3, :3] *= np.array(node.scale or [1.0, 1.0, 1.0])
    T[:3, 3] = node.translation or [0.0, 0.0, 0.0]
    return T
