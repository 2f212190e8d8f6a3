"""Animated nodes of glTF 2.0 files: channels, parents, mesh and picture."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation, Slerp

from ingest.animated.animated_take import as_mesh_part, choose, joined, split_stretch
from ingest.animated.animation import (
    Animation,
    check_times,
    checked,
    frame_times,
    not_finite,
    not_rigid,
)
from ingest.animated.keyframes import last_key
from ingest.formats.json_log import mentions
from ingest.mesh_files.file_parts import MAX_FACES, decoding, too_large
from ingest.mesh_files.gltf_container import GltfFile
from ingest.mesh_files.gltf_surface import GltfSurfaces, composed, drawn_nodes, local_matrix
from omomo_core.errors import DamageError, InputError
from omomo_core.motion import FPS

MAX_BYTES = 500 * 10**6
UNREADABLE = "gltf-unreadable"


def open_gltf(path: Path) -> GltfFile:
    """Read a GLB, or a glTF with what lies beside it.

    Raises:
        InputError: "gltf-too-large", "gltf-extension", "gltf-version" or "gltf-unreadable".
    """
    if path.stat().st_size > MAX_BYTES:
        raise InputError(
            "gltf-too-large",
            f"{path.name} has {path.stat().st_size / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} "
            "are read.",
            where=str(path),
            fix="Export the moving object alone, without textures.",
        )
    with decoding(path, UNREADABLE):
        file = GltfFile(path)
        file.check_resources()
    return file


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


def movers(file: GltfFile) -> dict[int, set[int]]:
    """The animations (by number) that move, turn or scale each node."""
    found: dict[int, set[int]] = {}
    for number, animation in enumerate(file.items("animations")):
        for channel in animation.get("channels") or ():
            node, path = channel["target"].get("node"), channel["target"].get("path")
            if node is not None and path in REST:
                found.setdefault(node, set()).add(number)
    return found


def channels(file: GltfFile, number: int, node: int) -> tuple[Channel, ...]:
    """The channels of one animation that move one node.

    Raises:
        InputError: "time-backwards", "pose-not-finite" or "gltf-keys".
    """
    animation = file.item("animations", number)
    return tuple(
        _channel(file, channel["target"]["path"], animation["samplers"][channel["sampler"]], node)
        for channel in animation.get("channels") or ()
        if channel["target"].get("node") == node and channel["target"].get("path") in REST
    )


def _channel(file: GltfFile, path: str, sampler: dict[str, Any], node: int) -> Channel:
    name = f"{file.source}, {path} of node {file.item('nodes', node).get('name') or node}"
    interpolation = sampler.get("interpolation") or "LINEAR"
    times = file.array(sampler["input"])[:, 0].astype(np.float64)
    raw = file.array(sampler["output"]).astype(np.float64)
    parts = 3 if interpolation == "CUBICSPLINE" else 1
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
    return Channel(path, interpolation, times, values)


NAME = "glTF"
FILES = "GLB or glTF with an animated node"


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
    with decoding(path, UNREADABLE):  # an index beyond a list, a view beyond its buffer, ...
        return _Scene(file).animation(node)


class _Scene:
    """The nodes of a file as a tree."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._nodes = file.items("nodes")
        self._movers = movers(file)
        self._drawn = {i for i, _ in drawn_nodes(file)}
        self._surfaces = GltfSurfaces(file)
        self._parents = {
            child: i for i, node in enumerate(self._nodes) for child in node.get("children") or ()
        }

    def animation(self, wanted: str | None) -> Animation:
        source = self._file.source
        names = [node.get("name") or f"node {i}" for i, node in enumerate(self._nodes)]
        solid = [i for i in sorted(self._movers) if any(True for _ in self._solids(i))]
        if not solid and not wanted and (bent := self._bent(*self._drawn)):
            raise self._skinned(names[bent[0]])
        node = choose(names, solid or sorted(self._movers), wanted, source)
        chain = self._ancestors(node)
        solids = list(self._solids(node))
        if not solids and (bent := self._bent(node)):
            raise self._skinned(names[bent[0]])
        moving = self._channels(chain, names[node])
        clocks = [c.times for found in moving.values() for c in found]
        first, last = min(c[0] for c in clocks), max(c[-1] for c in clocks)
        times = frame_times(float(first), float(last), source)
        placed = np.tile(np.eye(4), (len(times), 1, 1))
        for i in reversed(chain):
            placed = placed @ self._local(i, moving.get(i, ()), times)
        poses, stretch = split_stretch(placed, lambda k: f"{source}, {first + k / FPS:.2f} s")
        count = sum(self._surfaces.triangles(i) for i, _ in solids)
        if count > MAX_FACES:  # counted before many copies are spread out
            raise too_large(source, f"{count:,} triangles")
        parts = [
            as_mesh_part(part.moved(M)) for i, M in solids for part in self._surfaces.of_node(i)
        ]
        mesh = joined(parts, stretch, names[node], source)
        notes = not_rigid(*self._not_rigid(node, {i for i, _ in solids}, names))
        return Animation(source, poses, np.ones(len(times), bool), "y", mesh, notes)

    def _not_rigid(
        self, top: int, solids: set[int], names: list[str]
    ) -> tuple[list[str], list[str]]:
        """Names of the parts whose shape changes, and of those that move by themselves."""
        channels = (c for a in self._file.items("animations") for c in a.get("channels") or ())
        targets = (channel["target"] for channel in channels)
        morphed = {t.get("node") for t in targets if t.get("path") == "weights"}
        moving = {i for i in self._below(top) if i in self._movers and any(self._solids(i))}
        apart = moving.union(self._bent(top))
        return [names[i] for i in sorted(morphed & solids)], [names[i] for i in sorted(apart)]

    def _bent(self, *tops: int) -> list[int]:
        """Nodes, these or below these, that are drawn and whose mesh bones bend."""
        nodes = ((i, self._nodes[i]) for i in (*tops, *self._below(*tops)) if i in self._drawn)
        bent = {i for i, n in nodes if n.get("mesh") is not None and n.get("skin") is not None}
        return sorted(bent)

    def _below(self, *tops: int) -> list[int]:
        """Nodes below these."""
        below, stack = set(tops), list(tops)
        while stack:
            for child in self._nodes[stack.pop()].get("children") or ():
                if child not in below:
                    below.add(child)
                    stack.append(child)
        return sorted(below - set(tops))

    def _skinned(self, name: str) -> InputError:
        return InputError(
            "animation-skinned",
            f"The mesh of {name!r} in {self._file.source.name} is bent by bones (a skin); the object that a "
            "person moves is one rigid thing.",
            where=str(self._file.source),
            fix="Parent the object to its bone without weights, or bake its motion to its own location and "
            "rotation, and export again.",
        )

    def _ancestors(self, node: int) -> list[int]:
        """The node, its parent and so on up to the root."""
        chain = [node]
        while (parent := self._parents.get(chain[-1])) is not None:
            if parent in chain:
                raise DamageError("a node is its own ancestor")
            chain.append(parent)
        return chain

    def _channels(self, chain: list[int], name: str) -> dict[int, tuple[Channel, ...]]:
        """What moves each node of a chain; several animations may, each its own node."""
        source = self._file.source
        moving: dict[int, tuple[Channel, ...]] = {}
        for i in chain:
            numbers = sorted(self._movers.get(i, ()))
            if len(numbers) > 1:
                clips = self._file.items("animations")
                titles = [clips[k].get("name") or str(k) for k in numbers[:8]]
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
        if not moving:
            return np.repeat(local_matrix(node)[None], len(times), axis=0)
        still = {path: np.array(node.get(path) or rest, float) for path, rest in REST.items()}
        property_ = {path: np.tile(value, (len(times), 1)) for path, value in still.items()}
        property_ |= {channel.path: channel.at(times) for channel in moving}
        return composed(property_["translation"], property_["rotation"], property_["scale"])

    def _solids(self, top: int) -> Iterator[tuple[int, Float64[np.ndarray, "4 4"]]]:
        """(node, T_top_node) of the meshes that move rigidly with a node."""
        stack, seen = [(top, np.eye(4))], {top}
        while stack:
            i, T = stack.pop()
            node = self._nodes[i]
            if node.get("mesh") is not None and node.get("skin") is None and i in self._drawn:
                yield i, T
            for child in node.get("children") or ():
                if child not in self._movers and child not in seen:
                    seen.add(child)
                    stack.append((child, T @ local_matrix(self._nodes[child])))
