"""Animated nodes of glTF 2.0 files: channels, parents, mesh and picture."""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int
from PIL import Image
from pygltflib import GLTF2, AnimationSampler, BufferView, Primitive
from scipy.spatial.transform import Rotation, Slerp

from ingest.animated.animated_take import MeshPart, choose, joined, split_stretch
from ingest.animated.animation import Animation, check_times, checked, frame_times, not_finite
from ingest.animated.keyframes import last_key
from ingest.formats.json_log import mentions
from ingest.mesh_texture import Paint, pixels_of
from omomo_core.errors import InputError, reader_complaint
from omomo_core.motion import FPS

MAX_BYTES = 500 * 10**6
MAX_COUNT = 20_000_000

_DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@dataclass(frozen=True)
class GltfFile:
    """The scene description, and the bytes of each buffer."""

    source: Path
    gltf: GLTF2
    buffers: tuple[bytes, ...]

    def array(self, index: int) -> np.ndarray:
        """Values of an accessor, (count, components); floats where they are normalised integers."""
        accessor = self.gltf.accessors[index]
        width, dtype = _WIDTHS[accessor.type], np.dtype(_DTYPES[accessor.componentType])
        count = accessor.count
        if not 0 <= count <= MAX_COUNT:
            raise ValueError(f"accessor {index} has {count} elements")
        if accessor.bufferView is None:
            values = np.zeros((count, width), dtype)
        else:
            values = self._view(accessor.bufferView, accessor.byteOffset, count, width, dtype)
        if accessor.sparse is not None:
            sparse = accessor.sparse
            at, new = sparse.indices, sparse.values
            kind = np.dtype(_DTYPES[at.componentType])
            places = self._view(at.bufferView, at.byteOffset, sparse.count, 1, kind)[:, 0]
            values = values.copy()
            values[places] = self._view(new.bufferView, new.byteOffset, sparse.count, width, dtype)
        if not accessor.normalized or dtype.kind == "f":
            return values
        return np.maximum(values / np.iinfo(dtype).max, -1.0)

    def _view(
        self, index: int, offset: int | None, count: int, width: int, dtype: np.dtype
    ) -> np.ndarray:
        view: BufferView = self.gltf.bufferViews[index]
        first = (view.byteOffset or 0) + (offset or 0)
        stride = view.byteStride or width * dtype.itemsize
        # numpy itself refuses to look beyond the end of the buffer.
        return np.ndarray(
            (count, width), dtype, self.buffers[view.buffer], first, (stride, dtype.itemsize)
        )


def open_gltf(path: Path) -> GltfFile:
    """Read a GLB, or a glTF with its data inside.

    Raises:
        InputError: "gltf-too-large", "gltf-external", "gltf-compressed" or "gltf-unreadable".
    """
    if path.stat().st_size > MAX_BYTES:
        raise InputError(
            "gltf-too-large",
            f"{path.name} has {path.stat().st_size / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} "
            "are read.",
            where=str(path),
            fix="Export the moving object alone, without textures.",
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about chunks of extensions, which are skipped
            gltf = _parse(path.read_bytes())
        external = [b.uri for b in gltf.buffers if b.uri and not b.uri.startswith("data:")]
        buffers = () if external else tuple(_data(gltf, b.uri) for b in gltf.buffers)
    except Exception as problem:  # the decoders raise anything on a damaged file
        raise unreadable(path, problem) from None
    if external:
        raise InputError(
            "gltf-external",
            f"{path.name} keeps its data in another file: {str(external[0])[:60]}.",
            where=str(path),
            fix="Export as GLB: one file.",
        )
    packed = [e for e in gltf.extensionsRequired if "draco" in e or "meshopt" in e]
    if packed:
        raise InputError(
            "gltf-compressed",
            f"{path.name} is compressed ({', '.join(packed)}).",
            where=str(path),
            fix="Export it without compression.",
        )
    return GltfFile(path, gltf, buffers)


def unreadable(path: Path, problem: Exception) -> InputError:
    """The error for a file that violates the format."""
    return InputError(
        "gltf-unreadable",
        f"{path.name} cannot be read: {reader_complaint(problem)}.",
        where=str(path),
        fix="Open it in a 3D program and export it again as GLB.",
    )


def _parse(data: bytes) -> GLTF2:
    gltf = (
        GLTF2.load_from_bytes(data)
        if data.startswith(b"glTF")
        else GLTF2.from_json(data.decode("utf-8-sig"), infer_missing=True)
    )
    if gltf is None:
        raise ValueError("it has no scene")
    return gltf


def _data(gltf: GLTF2, uri: str | None) -> bytes:
    return gltf.decode_data_uri(uri) if uri else gltf.binary_blob() or b""


REST = {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}
"""What a node has where nothing else is said."""


@dataclass(frozen=True)
class Channel:
    """One property of one node over time."""

    path: str
    """translation, rotation or scale."""
    interpolation: str
    times: Float64[np.ndarray, " keys"]
    values: Float64[np.ndarray, "keys parts components"]
    """One part a key; in-tangent, value and out-tangent for CUBICSPLINE."""

    def at(self, times: Float64[np.ndarray, " frames"]) -> Float64[np.ndarray, "frames components"]:
        """The property at the wanted times; before the first and after the last key it is held."""
        clock, keys = self.times, self.values[:, self.values.shape[1] // 2]
        times = times.clip(clock[0], clock[-1])
        if len(clock) == 1:
            return np.repeat(keys, len(times), axis=0)
        k = last_key(clock, times)
        if self.interpolation == "STEP":
            return keys[k]
        k = k.clip(0, len(clock) - 2)
        if self.interpolation == "CUBICSPLINE":
            return self._cubic(times, k)
        if self.path == "rotation":
            return Slerp(clock, Rotation.from_quat(keys))(times).as_quat()
        u = ((times - clock[k]) / (clock[k + 1] - clock[k]))[:, None]
        return keys[k] + u * (keys[k + 1] - keys[k])

    def _cubic(
        self, times: Float64[np.ndarray, " frames"], k: np.ndarray
    ) -> Float64[np.ndarray, "frames components"]:
        step = (self.times[k + 1] - self.times[k])[:, None]
        u = (times - self.times[k])[:, None] / step
        before, after = self.values[k], self.values[k + 1]
        return (
            (2 * u**3 - 3 * u**2 + 1) * before[:, 1]
            + step * (u**3 - 2 * u**2 + u) * before[:, 2]
            + (3 * u**2 - 2 * u**3) * after[:, 1]
            + step * (u**3 - u**2) * after[:, 0]
        )


def movers(gltf: GLTF2) -> dict[int, set[int]]:
    """The animations (by number) that move, turn or scale each node."""
    found: dict[int, set[int]] = {}
    for number, animation in enumerate(gltf.animations):
        for channel in animation.channels:
            node = channel.target.node
            if node is not None and channel.target.path in REST:
                found.setdefault(node, set()).add(number)
    return found


def channels(file: GltfFile, number: int, node: int) -> tuple[Channel, ...]:
    """The channels of one animation that move one node.

    Raises:
        InputError: "time-backwards", "pose-not-finite" or "gltf-keys".
    """
    animation = file.gltf.animations[number]
    return tuple(
        _channel(file, channel.target.path, animation.samplers[channel.sampler], node)
        for channel in animation.channels
        if channel.target.node == node and channel.target.path in REST
    )


def _channel(file: GltfFile, path: str, sampler: AnimationSampler, node: int) -> Channel:
    name = f"{file.source}, {path} of node {file.gltf.nodes[node].name or node}"
    times = file.array(sampler.input)[:, 0].astype(np.float64)
    raw = file.array(sampler.output).astype(np.float64)
    parts = 3 if sampler.interpolation == "CUBICSPLINE" else 1
    width = len(REST[path])
    if raw.shape != (len(times) * parts, width) or len(times) == 0:
        raise InputError(
            "gltf-keys",
            f"There are {len(times)} times and {len(raw)} values of {raw.shape[1]} numbers.",
            where=name,
            fix="Export the animation again.",
        )
    values = raw.reshape(len(times), parts, width)
    finite = np.isfinite(times) & np.isfinite(values).all(axis=(1, 2))
    if not finite.all():
        raise not_finite(f"{name}, key {int(np.argmin(finite))}")
    if len(times) > 1:
        check_times(times, lambda key: f"{name}, key {key}", file.source)
    if path == "rotation":
        checked(values[:, parts // 2], lambda key: f"{name}, key {key}")
    return Channel(path, sampler.interpolation or "LINEAR", times, values)


def painted(file: GltfFile, primitive: Primitive, faces: Int[np.ndarray, "faces 3"]) -> Paint:
    """Places of the triangles' corners on the picture, and the picture.

    Two times None where the primitive has no picture inside the file, or one that cannot be read: it
    shapes no motion.
    """
    try:
        material = file.gltf.materials[primitive.material or 0].pbrMetallicRoughness
        told = None if primitive.material is None or material is None else material.baseColorTexture
        if told is None:
            return None, None
        places = getattr(primitive.attributes, f"TEXCOORD_{told.texCoord or 0}")
        uv = file.array(places).astype(np.float64)[faces]
        source = file.gltf.textures[told.index or 0].source
        return uv, pixels_of(Image.open(BytesIO(_bytes(file, source or 0))))
    except Exception:  # the decoders raise anything on a damaged file
        return None, None


def _bytes(file: GltfFile, index: int) -> bytes:
    image = file.gltf.images[index]
    if image.uri:
        return file.gltf.decode_data_uri(image.uri)
    view = file.gltf.bufferViews[image.bufferView]
    first = view.byteOffset or 0
    return file.buffers[view.buffer][first : first + view.byteLength]


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
                fix="Name an animated node with ‹node›, or export with animation.",
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
