"""An animated node of a GLB (or a glTF with its data inside): its motion, and its mesh."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from pygltflib import Primitive
from scipy.spatial.transform import Rotation

from ingest.animated.animation import Animation, frame_times
from ingest.animated.choice import choose
from ingest.animated.gltf_channels import REST, Channel, channels, movers
from ingest.animated.gltf_file import GltfFile, open_gltf, unreadable
from ingest.animated.gltf_picture import painted
from ingest.animated.stretch import split_stretch
from ingest.animated.surface import MeshPart, joined
from ingest.formats.json_file import mentions
from omomo_core.errors import InputError
from omomo_core.motion import FPS

NAME = "glTF"
FILES = "GLB or glTF with an animated node"

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def detect(path: Path) -> bool:
    """Whether it is a GLB, or begins like a glTF."""
    with path.open("rb") as file:
        if file.read(4) == b"glTF":
            return True
    return mentions(path, "asset", "nodes")


def read(path: Path, node: str | None = None) -> Animation:
    """The motion of a node by itself and its parents, and the mesh of what hangs on it.

    The mesh is what moves rigidly with the node: its own, and those below it that have no
    animation of their own. Skinned meshes are no objects. Scale is applied to the mesh.

    Args:
        path: the file.
        node: the name of the node; None where only one is animated and has a mesh.

    Raises:
        InputError: the file is damaged or kept in several; no node or several fit; its animation
            is not that of a rigid thing.
    """
    file = open_gltf(path)
    try:
        return _Scene(file).animation(node)
    except InputError:
        raise
    except Exception as problem:  # an index beyond a list, a view beyond its buffer, ...
        raise unreadable(path, problem) from None


class _Scene:
    """The nodes of a file as a tree."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._nodes = file.gltf.nodes
        self._movers = movers(file.gltf)
        self._parents = {c: i for i, node in enumerate(self._nodes) for c in node.children or ()}

    def animation(self, wanted: str | None) -> Animation:
        source = self._file.source
        names = [node.name or f"node {i}" for i, node in enumerate(self._nodes)]
        solid = [i for i in sorted(self._movers) if any(True for _ in self._solids(i))]
        node = choose(names, solid or sorted(self._movers), wanted, source)
        chain = self._ancestors(node)
        moving = self._channels(chain, names[node])
        clocks = [c.times for found in moving.values() for c in found]
        first, last = min(c[0] for c in clocks), max(c[-1] for c in clocks)
        times = frame_times(float(first), float(last), source)
        placed = np.tile(np.eye(4), (len(times), 1, 1))
        for i in reversed(chain):
            placed = placed @ self._local(i, moving.get(i, ()), times)
        poses, stretch = split_stretch(placed, lambda k: f"{source}, {first + k / FPS:.2f} s")
        parts = [part.moved(M) for i, M in self._solids(node) for part in self._parts(i)]
        mesh = joined(parts, stretch, names[node], source)
        return Animation(source, poses, np.ones(len(times), bool), "y", mesh)

    def _ancestors(self, node: int) -> list[int]:
        """The node, its parent and so on up to the root."""
        chain = [node]
        while (parent := self._parents.get(chain[-1])) is not None:
            if parent in chain:
                raise ValueError("a node is its own ancestor")
            chain.append(parent)
        return chain

    def _channels(self, chain: list[int], name: str) -> dict[int, tuple[Channel, ...]]:
        """What moves each node of a chain; several animations may, each its own node."""
        source = self._file.source
        moving: dict[int, tuple[Channel, ...]] = {}
        for i in chain:
            numbers = sorted(self._movers.get(i, ()))
            if len(numbers) > 1:
                titles = [self._file.gltf.animations[k].name or str(k) for k in numbers[:8]]
                raise InputError(
                    "animation-ambiguous",
                    f"{len(numbers)} animations of {source.name} move {name!r}: {', '.join(titles)}.",
                    where=str(source),
                    fix="Export one of them alone (in Blender: Animation mode Active Actions merged).",
                )
            if numbers:
                moving[i] = channels(self._file, numbers[0], i)
        if not moving:
            raise InputError(
                "animation-missing",
                f"Nothing moves {name!r} in {source.name}.",
                where=str(source),
                fix="Name an animated node with --node, or export with animation.",
            )
        return moving

    def _local(
        self, i: int, moving: tuple[Channel, ...], times: Float64[np.ndarray, " frames"]
    ) -> Float64[np.ndarray, "frames 4 4"]:
        """T_parent_node in each frame."""
        node = self._nodes[i]
        if node.matrix and not moving:
            matrix = np.array(node.matrix, np.float64).reshape(4, 4).T
            return np.repeat(matrix[None], len(times), axis=0)
        still = {path: getattr(node, path) or rest for path, rest in REST.items()}
        property_ = {path: np.tile(value, (len(times), 1)) for path, value in still.items()}
        property_ |= {channel.path: channel.at(times) for channel in moving}
        T = np.tile(np.eye(4), (len(times), 1, 1))
        R = Rotation.from_quat(property_["rotation"]).as_matrix()
        T[:, :3, :3] = R * property_["scale"][:, None]
        T[:, :3, 3] = property_["translation"]
        return T

    def _solids(self, top: int) -> Iterator[tuple[int, Float64[np.ndarray, "4 4"]]]:
        """(node, T_top_node) of the meshes that move rigidly with a node."""
        stack, seen = [(top, np.eye(4))], {top}
        while stack:
            i, T = stack.pop()
            node = self._nodes[i]
            if node.mesh is not None and node.skin is None:
                yield i, T
            for child in node.children or ():
                if child not in self._movers and child not in seen:
                    seen.add(child)
                    stack.append((child, T @ self._local(child, (), np.zeros(1))[0]))

    def _parts(self, i: int) -> Iterator[MeshPart]:
        """Vertices and triangles of a node's mesh, in the node's axes."""
        for primitive in self._file.gltf.meshes[self._nodes[i].mesh or 0].primitives:
            faces = self._faces(primitive)
            if len(faces):
                position = primitive.attributes.POSITION
                if position is None:
                    raise ValueError("a primitive has no positions")
                vertices = self._file.array(position).astype(np.float64)
                yield MeshPart(vertices, faces, *painted(self._file, primitive, faces))

    def _faces(self, primitive: Primitive) -> np.ndarray:
        if primitive.indices is None:
            count = self._file.gltf.accessors[primitive.attributes.POSITION or 0].count
            corners = np.arange(count)
        else:
            corners = self._file.array(primitive.indices)[:, 0].astype(np.int64)
        mode = _TRIANGLES if primitive.mode is None else primitive.mode
        if mode == _TRIANGLES:
            return corners[: len(corners) // 3 * 3].reshape(-1, 3)
        if mode == _STRIP:
            faces = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
            faces[1::2] = faces[1::2, ::-1]
            return faces
        if mode == _FAN:
            return np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], 1)
        return np.empty((0, 3), np.int64)  # points and lines are no surface
