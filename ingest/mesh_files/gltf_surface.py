"""Surfaces of glTF files as they are drawn at rest: nodes, instances, skins, morph targets, materials."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64, Int64, UInt8
from PIL import Image
from scipy.spatial.transform import Rotation

from ingest.mesh_files.file_parts import FilePart, ReadMesh, constant_colour, only_used, too_large
from ingest.mesh_files.gltf_compression import DRACO, DracoPrimitive
from ingest.mesh_files.gltf_container import GltfFile
from ingest.mesh_texture import BaseColour, to_srgb
from omomo_core.errors import DamageError

TRIANGLES, STRIP, FAN = 4, 5, 6
_INSTANCED, _LOD, _HIDES = "EXT_mesh_gpu_instancing", "MSFT_lod", "KHR_node_visibility"
_PICTURES = ("EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds")
_MOST_INSTANCES = 1_000_000

Matrices = Float64[np.ndarray, "copies 4 4"]


def read_gltf(path: Path, most: int) -> ReadMesh:
    """Read what the default scene of a glTF draws, in its own axes (y up).

    Args:
        path: a GLB, or a glTF with its files beside it.
        most: triangles that are read.

    Raises:
        InputError: "gltf-version", "gltf-extension", "gltf-compressed", "gltf-external",
            "mesh-too-large".
        Exception: the file is damaged.
    """
    file = GltfFile(path)
    surfaces = GltfSurfaces(file)
    drawn = list(drawn_nodes(file))
    count = sum(surfaces.triangles(i) for i, _ in drawn)
    if count > most:  # counted before a scene of many copies is spread out
        raise too_large(path, f"{count:,} triangles")
    parts = [part for i, T in drawn for part in surfaces.placed(i, T)]
    return ReadMesh(tuple(_named(parts)), (*_scene_notes(file), *surfaces.notes()))


def _named(parts: list[FilePart]) -> Iterator[FilePart]:
    """The parts with names of their own."""
    seen: Counter[str] = Counter()
    for part in parts:
        seen[part.name] += 1
        again = seen[part.name] > 1
        yield replace(part, name=f"{part.name}/{seen[part.name]}") if again else part


def _scene_notes(file: GltfFile) -> Iterator[str]:
    scenes = file.items("scenes")
    if len(scenes) > 1:
        yield f"the default one of {len(scenes)} scenes"
    used = [str(name) for name in file.json.get("extensionsUsed") or ()]
    if file.unpacked:
        yield f"decompressed ({', '.join(sorted(file.unpacked))})"
    if "KHR_materials_variants" in used:
        yield "the default one of its material variants"
    if file.unknown:
        yield f"without what {', '.join(file.unknown[:4])} may add"


def drawn_nodes(file: GltfFile) -> Iterator[tuple[int, Float64[np.ndarray, "4 4"]]]:
    """(node, T_scene_node) of the default scene, without what is hidden and coarser levels of detail.

    Raises:
        ValueError: a node is its own ancestor, or has two parents.
    """
    nodes, scenes = file.items("nodes"), file.items("scenes")
    children = {child for node in nodes for child in node.get("children") or ()}
    roots: list[int] = [i for i in range(len(nodes)) if i not in children]
    if scenes:
        roots = file.item("scenes", file.json.get("scene") or 0).get("nodes") or []
    coarse = {i for node in nodes for i in (_extension(node, _LOD).get("ids") or ())}
    stack, seen = [(root, np.eye(4)) for root in reversed(roots)], set[int]()
    while stack:
        i, T_parent = stack.pop()
        node = file.item("nodes", i)
        if i in coarse or not _extension(node, _HIDES).get("visible", True):
            continue
        if i in seen:
            raise DamageError("a node hangs on two parents, or on itself")
        seen.add(i)
        T = T_parent @ local_matrix(node)
        yield i, T
        stack += [(child, T) for child in reversed(node.get("children") or ())]


def local_matrix(node: dict[str, Any]) -> Float64[np.ndarray, "4 4"]:
    """T_parent_node at rest."""
    if node.get("matrix"):
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    told = [node.get(key) for key in ("translation", "rotation", "scale")]
    rest = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [1.0, 1.0, 1.0])
    t, q, s = (np.array([a or b], np.float64) for a, b in zip(told, rest, strict=True))
    return composed(t, q, s)[0]


def composed(
    translation: Float64[np.ndarray, "n 3"],
    quaternion: Float64[np.ndarray, "n 4"],
    scale: Float64[np.ndarray, "n 3"],
) -> Matrices:
    """Matrices of translations, rotations (x, y, z, w) and scales."""
    T = np.tile(np.eye(4), (len(translation), 1, 1))
    T[:, :3, :3] = Rotation.from_quat(quaternion).as_matrix() * scale[:, None]
    T[:, :3, 3] = translation
    return T


def _extension(told: dict[str, Any], name: str) -> dict[str, Any]:
    return (told.get("extensions") or {}).get(name) or {}


@dataclass(frozen=True)
class _Look:
    """What a material says of the base colour."""

    factor: tuple[float, float, float] | None
    """Linear, 0 to 1; None where the file states none."""
    texture: dict[str, Any] | None


class GltfSurfaces:
    """Reads the meshes of a file and keeps account of what it did."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._images: dict[int, Image.Image | None] = {}
        self._colours: dict[tuple[int, tuple[float, float, float] | None], BaseColour] = {}
        nodes = file.items("nodes")
        self._parents = {child: i for i, n in enumerate(nodes) for child in n.get("children") or ()}
        self._did: Counter[str] = Counter()
        self._lost: set[str] = set()

    def notes(self) -> tuple[str, ...]:
        """What was done to read the meshes."""
        instances, copies = self._did["instanced"], self._did["instances"]
        did = [f"{instances:,} triangles from {copies:,} instances"] if copies else []
        words = {
            "skin": "skin applied in its rest pose",
            "morph": "morph targets applied by their resting weights",
        }
        did += [text for key, text in words.items() if self._did[key]]
        if self._did["no surface"]:
            did.append(f"{self._did['no surface']} parts of lines or points left out")
        return (*did, *sorted(self._lost))

    def triangles(self, i: int) -> int:
        """How many triangles a node draws, by what the file says."""
        node = self._file.item("nodes", i)
        if node.get("mesh") is None:
            return 0
        primitives = self._file.item("meshes", node["mesh"])["primitives"]
        return sum(map(self._stated, primitives)) * self._copies(node)

    def _stated(self, primitive: dict[str, Any]) -> int:
        mode, position = primitive.get("mode", TRIANGLES), primitive["attributes"].get("POSITION")
        if mode not in (TRIANGLES, STRIP, FAN) or position is None:
            return 0
        corners = self._file.count(primitive.get("indices", position))
        return corners // 3 if mode == TRIANGLES else max(0, corners - 2)

    def _copies(self, node: dict[str, Any]) -> int:
        told = _extension(node, _INSTANCED).get("attributes") or {}
        counts = [self._file.count(index) for index in told.values()]
        if counts and max(counts) > _MOST_INSTANCES:
            raise DamageError(f"it has {max(counts):,} instances")
        return min(counts, default=1)

    def placed(self, i: int, T: Float64[np.ndarray, "4 4"]) -> Iterator[FilePart]:
        """The parts of a node in the scene's axes.

        Args:
            i: the node.
            T: T_scene_node, which counts for no skinned part: its joints place that.
        """
        node = self._file.item("nodes", i)
        skin = None if node.get("skin") is None else self._bones(node["skin"])
        for primitive, part in self._primitives(node):
            weights = None if skin is None else self._weights(primitive, len(skin))
            if skin is not None and weights is not None:
                self._did["skin"] += 1
                yield _skinned(part, skin, weights)
            else:
                yield from (copy.moved(T) for copy in self._instances(node, part))

    def of_node(self, i: int) -> Iterator[FilePart]:
        """The parts of a node in its own axes, all their instances among them."""
        node = self._file.item("nodes", i)
        for _, part in self._primitives(node):
            yield from self._instances(node, part)

    def _primitives(self, node: dict[str, Any]) -> Iterator[tuple[dict[str, Any], FilePart]]:
        if node.get("mesh") is None:
            return
        mesh = self._file.item("meshes", node["mesh"])
        name = str(node.get("name") or mesh.get("name") or f"mesh {node['mesh']}")
        weights = node.get("weights") or mesh.get("weights") or []
        for primitive in mesh["primitives"]:
            if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN):
                self._did["no surface"] += 1
            elif primitive["attributes"].get("POSITION") is not None:
                part = self._primitive(primitive, weights, name)
                if len(part.faces):
                    yield primitive, part

    def _primitive(self, primitive: dict[str, Any], weights: list[float], name: str) -> FilePart:
        packed = self._draco(primitive)
        vertices = self._attribute(primitive, "POSITION", packed)[:, :3].astype(np.float64)
        targets = primitive.get("targets") or []
        for weight, target in zip(weights, targets, strict=False):
            if weight and target.get("POSITION") is not None:
                vertices = vertices + float(weight) * self._file.array(target["POSITION"])
                self._did["morph"] += 1
        faces = self._faces(primitive, len(vertices), packed)
        only_used(vertices, faces)
        look = self._look(primitive)
        picture, places = self._painted(primitive, look, faces, packed)
        own = look if picture is None else replace(look, factor=None)
        colours = self._vertex_colours(primitive, own, len(vertices), packed)
        if picture is not None and colours is not None:
            tinted = bool((colours < 255).any())
            self._lost |= {"colours of vertices over a picture left out"} if tinted else set()
            colours = None
        return FilePart(name, vertices, faces, colours, places, picture)

    def _draco(self, primitive: dict[str, Any]) -> DracoPrimitive | None:
        """The primitive's packed data, where it has no other."""
        told = _extension(primitive, DRACO)
        if not told:
            return None
        position = self._file.item("accessors", primitive["attributes"]["POSITION"])
        if position.get("bufferView") is not None:
            return None  # the fallback is exact
        self._file.unpacked.add(DRACO)
        return DracoPrimitive(self._file.view(told["bufferView"]), told, self._file.source)

    def _attribute(
        self, primitive: dict[str, Any], name: str, packed: DracoPrimitive | None
    ) -> np.ndarray:
        index = primitive["attributes"][name]
        if packed is None or not packed.has(name):
            return self._file.array(index)
        normalized = bool(self._file.item("accessors", index).get("normalized"))
        return packed.values(name, normalized=normalized)

    def _faces(
        self, primitive: dict[str, Any], count: int, packed: DracoPrimitive | None
    ) -> Int64[np.ndarray, "faces 3"]:
        if packed is not None:
            return packed.triangles
        if primitive.get("indices") is None:
            corners = np.arange(count)
        else:
            corners = self._file.array(primitive["indices"])[:, 0].astype(np.int64)
        return triangles_of_mode(corners, primitive.get("mode", TRIANGLES))

    def _look(self, primitive: dict[str, Any]) -> _Look:
        if primitive.get("material") is None:
            return _Look(None, None)
        material = self._file.item("materials", primitive["material"])
        rough = material.get("pbrMetallicRoughness") or {}
        glossy = _extension(material, "KHR_materials_pbrSpecularGlossiness")
        factor = rough.get("baseColorFactor") or glossy.get("diffuseFactor")
        texture = rough.get("baseColorTexture") or glossy.get("diffuseTexture")
        red, green, blue = (factor or [1.0, 1.0, 1.0])[:3]
        return _Look((float(red), float(green), float(blue)) if factor else None, texture)

    def _painted(
        self,
        primitive: dict[str, Any],
        look: _Look,
        faces: Int64[np.ndarray, "faces 3"],
        packed: DracoPrimitive | None,
    ) -> tuple[BaseColour | None, Float64[np.ndarray, "faces 3 2"] | None]:
        """The picture and the places of the corners on it; it shapes no motion, so it may be lost."""
        if look.texture is None:
            return None, None
        try:
            moved = _extension(look.texture, "KHR_texture_transform")
            wanted = moved.get("texCoord", look.texture.get("texCoord") or 0)
            uv = self._attribute(primitive, f"TEXCOORD_{wanted}", packed)[:, :2].astype(np.float64)
            image = self._image(look.texture.get("index"))
            if image is None:
                return None, None
            key = (id(image), look.factor)
            picture = self._colours.setdefault(key, BaseColour(image, look.factor))
            return picture, _transformed(uv, moved)[faces]
        except Exception:  # the decoders raise anything on a damaged picture
            self._lost.add("a picture that cannot be read left out")
            return None, None

    def _image(self, index: Any) -> Image.Image | None:
        texture = self._file.item("textures", index)
        extra = (_extension(texture, name).get("source") for name in _PICTURES)
        sources = [k for k in (texture.get("source"), *extra) if k is not None]
        if not sources:
            if _extension(texture, "KHR_texture_basisu"):
                self._lost.add("its pictures left out, which are KTX2 (KHR_texture_basisu)")
            return None
        source = sources[0]
        if source not in self._images:
            told = self._file.item("images", source)
            uri = told.get("uri")
            data = self._file.view(told["bufferView"]) if uri is None else self._file.resource(uri)
            self._images[source] = Image.open(BytesIO(data))
        return self._images[source]

    def _vertex_colours(
        self,
        primitive: dict[str, Any],
        look: _Look,
        count: int,
        packed: DracoPrimitive | None,
    ) -> UInt8[np.ndarray, "verts 3"] | None:
        """sRGB; glTF's colours of vertices and materials are linear, and multiplied."""
        factor = np.ones(3) if look.factor is None else np.array(look.factor, np.float64)
        if primitive["attributes"].get("COLOR_0") is None:
            return None if look.factor is None else constant_colour(to_srgb(factor), count)
        linear = self._attribute(primitive, "COLOR_0", packed)[:, :3]
        scale = 1.0 if linear.dtype.kind == "f" else float(np.iinfo(linear.dtype).max)
        return to_srgb(linear / scale * factor)

    def _instances(self, node: dict[str, Any], part: FilePart) -> Iterator[FilePart]:
        told = _extension(node, _INSTANCED).get("attributes")
        if not told:
            yield part
            return
        matrices = self._instance_matrices(told, self._copies(node))
        self._did["instances"] += len(matrices)
        self._did["instanced"] += len(matrices) * len(part.faces)
        mirrored = np.linalg.det(matrices[:, :3, :3]) < 0
        for copies in (matrices[~mirrored], matrices[mirrored]):
            if len(copies):
                yield _spread(part, copies)

    def _instance_matrices(self, told: dict[str, Any], count: int) -> Matrices:
        rest = {"TRANSLATION": [0.0] * 3, "ROTATION": [0.0, 0.0, 0.0, 1.0], "SCALE": [1.0] * 3}
        t, q, s = (
            self._file.array(told[key])[:count].astype(np.float64)
            if key in told
            else np.tile(np.array(value), (count, 1))
            for key, value in rest.items()
        )
        return composed(t, q, s)

    def _bones(self, index: Any) -> Matrices:
        """Matrices that bring vertices into the scene's axes, one a joint."""
        skin = self._file.item("skins", index)
        joints = skin["joints"]
        placed = np.stack([self._world(joint) for joint in joints])
        if skin.get("inverseBindMatrices") is None:
            return placed
        inverse = self._file.array(skin["inverseBindMatrices"])[: len(joints)]
        return placed @ inverse.astype(np.float64).reshape(-1, 4, 4).swapaxes(1, 2)

    def _world(self, i: int) -> Float64[np.ndarray, "4 4"]:
        """T_scene_node."""
        chain = [i]
        while (parent := self._parents.get(chain[-1])) is not None and parent not in chain:
            chain.append(parent)
        if parent is None:
            steps = [local_matrix(self._file.item("nodes", k)) for k in reversed(chain)]
            return np.linalg.multi_dot(steps) if len(steps) > 1 else steps[0]
        raise DamageError("a node hangs on itself")

    def _weights(
        self, primitive: dict[str, Any], joints: int
    ) -> tuple[Int64[np.ndarray, "verts n"], Float64[np.ndarray, "verts n"]] | None:
        """Numbers and weights of the joints of each vertex; None where the primitive has none."""
        packed, attributes = self._draco(primitive), primitive["attributes"]
        sets = [k for k in range(8) if f"JOINTS_{k}" in attributes and f"WEIGHTS_{k}" in attributes]
        if not sets:
            return None
        names = [self._attribute(primitive, f"JOINTS_{k}", packed) for k in sets]
        weights = [self._attribute(primitive, f"WEIGHTS_{k}", packed) for k in sets]
        joint = np.concatenate(names, axis=1).astype(np.int64)
        weight = np.concatenate(weights, axis=1).astype(np.float64)
        if len(joint) and not 0 <= joint.min() <= joint.max() < joints:
            raise DamageError("a vertex names a joint that is not there")
        total = weight.sum(axis=1, keepdims=True)
        return joint, np.divide(weight, total, out=np.zeros_like(weight), where=total > 0)


def _skinned(
    part: FilePart,
    bones: Matrices,
    weights: tuple[Int64[np.ndarray, "verts n"], Float64[np.ndarray, "verts n"]],
) -> FilePart:
    """A part where its joints bring it."""
    vertices = np.concatenate([part.vertices, np.ones((len(part.vertices), 1))], axis=1)
    there = np.zeros_like(part.vertices)
    for joint, weight in zip(weights[0].T, weights[1].T, strict=True):
        there += weight[:, None] * np.einsum("nij,nj->ni", bones[joint][:, :3], vertices)
    used = np.unique(weights[0][weights[1] > 0])
    if len(used) and np.linalg.det(bones[used, :3, :3]).max() < 0:
        part = part.moved(np.diag([-1.0, 1.0, 1.0, 1.0]))  # only to turn the triangles
    return replace(part, vertices=there)


def _spread(part: FilePart, T: Matrices) -> FilePart:
    """Copies of a part in one, all of them mirrored or none."""
    used, faces = only_used(part.vertices, part.faces)
    own = replace(
        part,
        vertices=part.vertices[used],
        faces=faces,
        colours=None if part.colours is None else part.colours[used],
    ).moved(np.diag([np.sign(np.linalg.det(T[0, :3, :3])) or 1.0, 1.0, 1.0, 1.0]))
    vertices = np.einsum("kij,nj->kni", T[:, :3, :3], part.vertices[used]) + T[:, None, :3, 3]
    first = np.arange(len(T))[:, None, None] * len(used)
    places, colours = own.places, own.colours
    return replace(
        own,
        vertices=vertices.reshape(-1, 3),
        faces=(own.faces[None] + first).reshape(-1, 3),
        places=None if places is None else np.tile(places, (len(T), 1, 1)),
        colours=None if colours is None else np.tile(colours, (len(T), 1)),
    )


def triangles_of_mode(
    corners: Int64[np.ndarray, " corners"], mode: int
) -> Int64[np.ndarray, "faces 3"]:
    """Triangles of a list, a strip or a fan of corners; strips' joints, which have no area, are left out."""
    if mode == TRIANGLES or len(corners) < 3:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if mode == STRIP:
        faces = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
        faces[1::2] = faces[1::2, ::-1]
    else:
        faces = np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], 1)
    apart = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return faces[apart]


def _transformed(
    uv: Float64[np.ndarray, "verts 2"], told: dict[str, Any]
) -> Float64[np.ndarray, "verts 2"]:
    """Places on the picture by KHR_texture_transform: scaled, turned against the clock, moved."""
    scaled = uv * np.array(told.get("scale") or [1.0, 1.0], np.float64)
    angle = float(told.get("rotation") or 0.0)
    c, s = np.cos(angle), np.sin(angle)
    # v points down, so that a turn against the clock has this sign.
    turned = scaled @ np.array([[c, s], [-s, c]]).T
    return turned + np.array(told.get("offset") or [0.0, 0.0], np.float64)
