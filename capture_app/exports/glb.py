"""GLB (binary glTF 2.0): the skinned body and the moving object in one clip.

Follows the glTF 2.0 specification, sections 3.7.3 (skins) and 3.11 (animations), and for VRM's bones
VRMC_vrm_animation 1.0.
"""

import json
import struct
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pygltflib import (
    ARRAY_BUFFER,
    ELEMENT_ARRAY_BUFFER,
    FLOAT,
    GLTF2,
    UNSIGNED_INT,
    UNSIGNED_SHORT,
    Accessor,
    Animation,
    AnimationChannel,
    AnimationChannelTarget,
    AnimationSampler,
    Asset,
    Attributes,
    Buffer,
    BufferView,
    Image,
    Material,
    Mesh,
    Node,
    PbrMetallicRoughness,
    Primitive,
    Scene,
    Skin,
    TextureInfo,
)
from pygltflib import Texture as GltfTexture
from scipy.spatial.transform import Rotation

from capture_app.blender_extension.bone_names import BONE_NAMES
from capture_app.commands.export import Bones
from capture_app.exports import exported_take as taken
from capture_app.exports.bones import creased, take_on_own_bones
from capture_app.exports.contact_spans import ExportedContact, contact_spans
from capture_app.exports.exported_take import Take, placed, pose_locals, rest_locals
from capture_app.exports.reduced_keys import reduced_keys
from capture_app.exports.resample import Sampled, frames_of
from capture_app.picture_bytes import PictureBytes, encoded
from omomo_core.body.model import BodyModel
from omomo_core.geometry.rotations import xyzw_from_matrix
from omomo_core.long_arrays import GrowingArray, let_go, row_blocks
from omomo_core.motion import FPS, HumanMotion, ObjectMesh, ObjectMotion, Texture

_COMPONENT = {"float32": FLOAT, "uint16": UNSIGNED_SHORT, "uint32": UNSIGNED_INT}
_TYPE = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class GlbBuffer:
    """Collects arrays; each `add` returns the index of a new accessor.

    Args:
        gltf: the scene that they belong to.
        data: what its buffer holds already.
    """

    def __init__(self, gltf: GLTF2, data: bytes = b"") -> None:
        self._gltf = gltf
        self._pieces: list[bytes | np.ndarray] = [data, b"\0" * (-len(data) % 4)]
        self._length = len(data) + -len(data) % 4

    def vertices(self, values: np.ndarray, dtype: str = "float32") -> int:
        """One value per vertex: positions, normals, joints, weights."""
        return self._add(values.astype(dtype), ARRAY_BUFFER)

    def indices(self, faces: np.ndarray) -> int:
        """Triangles as a flat list of vertex indices."""
        return self._add(faces.reshape(-1).astype("uint32"), ELEMENT_ARRAY_BUFFER)

    def values(self, values: np.ndarray) -> int:
        """Key frames or matrices (row, column; the file stores them column by column)."""
        values = values.astype("float32", copy=False)
        return self._add(values.swapaxes(-1, -2) if values.ndim == 3 else values, None)

    def texture(self, picture: PictureBytes) -> int:
        """A picture, for a material."""
        gltf = self._gltf
        view = self._view(picture.data, None)
        gltf.images.append(Image(bufferView=view, mimeType=picture.mime))
        gltf.textures.append(GltfTexture(source=len(gltf.images) - 1))
        return len(gltf.textures) - 1

    def scene(self) -> dict[str, Any]:
        """Return the JSON of the scene, with all that was added."""
        first = Buffer(byteLength=self._length)
        self._gltf.buffers = [first, *self._gltf.buffers[1:]]
        return json.loads(self._gltf.gltf_to_json())

    def write(self, path: Path, scene: dict[str, Any] | None = None) -> None:
        """Write the file: glTF 2.0, section 4.4. `scene` is its JSON, if it is not `scene()`."""
        text = json.dumps(scene or self.scene(), separators=(",", ":")).encode()
        scene_part = text + b" " * (-len(text) % 4)
        whole = 12 + 8 + len(scene_part) + 8 + self._length
        with path.open("wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, whole))
            file.write(struct.pack("<I4s", len(scene_part), b"JSON") + scene_part)
            file.write(struct.pack("<I4s", self._length, b"BIN\0"))
            for piece in self._pieces:
                if isinstance(piece, bytes):
                    file.write(piece)
                else:
                    file.write(piece.tobytes())
                    let_go(piece)

    def _view(self, data: bytes | np.ndarray, target: int | None) -> int:
        """Add bytes, and return the index of their view."""
        size = data.nbytes if isinstance(data, np.ndarray) else len(data)
        view = BufferView(buffer=0, byteOffset=self._length, byteLength=size, target=target)
        self._gltf.bufferViews.append(view)
        self._pieces += [data, b"\0" * (-size % 4)]
        self._length += size + -size % 4
        return len(self._gltf.bufferViews) - 1

    def _add(self, values: np.ndarray, target: int | None) -> int:
        view = self._view(np.ascontiguousarray(values), target)
        flat = values.reshape(len(values), -1)
        self._gltf.accessors.append(
            Accessor(
                bufferView=view,
                componentType=_COMPONENT[values.dtype.name],
                count=len(values),
                type=_TYPE[values.shape[1:]],
                min=flat.min(axis=0).tolist(),
                max=flat.max(axis=0).tolist(),
            )
        )
        let_go(values)
        return len(self._gltf.accessors) - 1


BLUE = (0.16, 0.33, 0.55)
ORANGE = (0.85, 0.36, 0.10)
"""Colours of the person and of the object, linear RGB."""
_BODY_MATERIAL = 0


def write_glb(path: Path, human: HumanMotion, object_motion: ObjectMotion, body: BodyModel) -> None:
    """Write a motion at 30 fps on our own bones, as `write_glb_take` does.

    Args:
        path: the .glb file to write.
        human: world z up, metres.
        object_motion: as many frames as `human`.
        body: its bones must be those that `human` moves.
    """
    names = BONE_NAMES[Bones.smplx]
    blocks = (frames_of(human, object_motion, some) for some in row_blocks(len(human.root)))
    spans = contact_spans(Sampled(human, object_motion, FPS))
    _write(path, (take_on_own_bones(Sampled(*block, FPS), body, names) for block in blocks), spans)


def write_glb_take(
    path: Path, take: Take, *, vrm: bool = False, reduce_to: float | None = None
) -> None:
    """Write a take as one file that Blender, Unity, Unreal, three.js and model viewers open.

    Nodes: the joints by their names (the way of the body on the hips), "body" (the skin) and
    "object". The turn of the world from z up to y up is part of the key frames: importers that drop a
    node above the figure still stand it upright. The node of the object carries the contacts as
    `extras`: part, from, to (seconds), and for a hand the point on the object. Metres, seconds.

    Args:
        path: the .glb file to write.
        take: in our own world.
        vrm: say which joint is which humanoid bone, as in a .vrma file.
        reduce_to: leave out keys while joints stay that near to where they are, metres.
    """
    keys = None if reduce_to is None else reduced_keys(take, reduce_to)
    _write(path, [take], take.spans, vrm=vrm, keys=keys)


def _write(
    path: Path,
    blocks: Iterable[Take],
    spans: Iterable[ExportedContact],
    *,
    vrm: bool = False,
    keys: Mapping[int, np.ndarray] | None = None,
) -> None:
    """Write consecutive stretches of a take as one; `keys` are frames of each joint, and of -1."""
    blocks = (placed(block, "y", "m") for block in blocks)
    take = next(blocks)
    gltf = GLTF2(asset=_asset(take))
    buffer = GlbBuffer(gltf)
    gltf.materials = [_material("body", BLUE), object_material(buffer, take.mesh.texture)]
    gltf.meshes = [_body_mesh(buffer, take.skin), object_mesh(buffer, take.mesh, 1)]
    gltf.nodes = _joint_nodes(take.skeleton)
    figure, thing = len(gltf.nodes), len(gltf.nodes) + 1
    # Blender and others drop the credit of the file when they write it again, and keep that of a node.
    body = Node(name="body", mesh=0, skin=0, extras={"credit": take.credit})
    gltf.nodes += [body, object_node(take, spans, 1)]
    gltf.skins = [_skin(buffer, take.skeleton)]
    moves = (_moves(block, thing) for block in chain([take], blocks))
    gltf.animations = [animation_of(buffer, moves, take.fps, path.parent, of_nodes(keys, thing))]
    gltf.scenes = [Scene(nodes=[0, figure, thing])]
    gltf.scene = 0
    if vrm:
        gltf.extensionsUsed = ["VRMC_vrm_animation"]
        gltf.extensions = {"VRMC_vrm_animation": _humanoid(take)}
    buffer.write(path)


def _asset(take: Take) -> Asset:
    return Asset(
        version="2.0",
        generator=f"omocap {version('omocap')}",
        copyright=take.credit,
        extras={"body": take.body, "credit": take.credit},
    )


def _material(name: str, colour: tuple[float, float, float]) -> Material:
    surface = PbrMetallicRoughness(
        baseColorFactor=[*colour, 1.0], metallicFactor=0.0, roughnessFactor=0.7
    )
    # Scanned and hand-made meshes have holes and flipped faces: show both sides.
    return Material(name=name, pbrMetallicRoughness=surface, doubleSided=True)


def object_material(buffer: GlbBuffer, texture: Texture | None) -> Material:
    """Return orange, or what the object's own picture shows."""
    if texture is None:
        return _material("object", ORANGE)
    material = _material("object", (1.0, 1.0, 1.0))
    surface = material.pbrMetallicRoughness
    assert surface is not None
    surface.baseColorTexture = TextureInfo(index=buffer.texture(encoded(texture.image)))
    return material


def _body_mesh(buffer: GlbBuffer, skin: taken.Skin) -> Mesh:
    attributes = Attributes(
        POSITION=buffer.vertices(skin.vertices),
        NORMAL=buffer.vertices(skin.normals),
        JOINTS_0=buffer.vertices(skin.joints, "uint16"),
        WEIGHTS_0=buffer.vertices(skin.weights),
    )
    indices = buffer.indices(skin.faces)
    return Mesh(
        name="body",
        primitives=[Primitive(attributes=attributes, indices=indices, material=_BODY_MATERIAL)],
    )


def object_mesh(buffer: GlbBuffer, mesh: ObjectMesh, material: int) -> Mesh:
    """Return the object's mesh, of a material of the file."""
    shown = creased(mesh)
    attributes = Attributes(
        POSITION=buffer.vertices(shown.vertices), NORMAL=buffer.vertices(shown.normals)
    )
    if shown.uv is not None:
        attributes.TEXCOORD_0 = buffer.vertices(shown.uv)
    indices = buffer.indices(shown.faces)
    return Mesh(
        name=mesh.name,
        primitives=[Primitive(attributes=attributes, indices=indices, material=material)],
    )


def _joint_nodes(skeleton: taken.Skeleton) -> list[Node]:
    rest = rest_locals(skeleton)
    turns = Rotation.from_matrix(rest.rotations).as_quat(canonical=True)
    nodes: list[Node] = []
    for j, name in enumerate(skeleton.names):
        children = [k for k, parent in enumerate(skeleton.parents) if parent == j]
        node = Node(name=name, translation=rest.positions[j].tolist(), children=children)
        node.rotation = turns[j].tolist()
        nodes.append(node)
    return nodes


def object_node(take: Take, spans: Iterable[ExportedContact], mesh: int) -> Node:
    """Return the object's node, which carries the contacts; `mesh` is its mesh in the file."""
    T = take.T_world_object[:1]
    return Node(
        name="object",
        mesh=mesh,
        translation=T[0, :3, 3].tolist(),
        rotation=xyzw_from_matrix(T[:, :3, :3])[0].tolist(),
        extras={"contacts": [span.described for span in spans]},
    )


def _skin(buffer: GlbBuffer, skeleton: taken.Skeleton) -> Skin:
    matrices = np.tile(np.eye(4), (len(skeleton.names), 1, 1))
    R = skeleton.rotations.swapaxes(1, 2)
    matrices[:, :3, :3] = R
    matrices[:, :3, 3] = -np.einsum("jxy,jy->jx", R, skeleton.positions)
    joints = list(range(len(skeleton.names)))
    return Skin(
        name="skeleton", skeleton=0, joints=joints, inverseBindMatrices=buffer.values(matrices)
    )


class Track(NamedTuple):
    """What moves a node: "translation" or "rotation"."""

    node: int
    path: str


Moves = dict[Track, np.ndarray]
"""Positions, or rotation matrices, of the nodes that move, relative to what they hang on."""


def animation_of(
    buffer: GlbBuffer,
    blocks: Iterable[Moves],
    fps: float,
    folder: Path,
    keys: Mapping[int, np.ndarray] | None = None,
) -> Animation:
    """Return the moving nodes of consecutive stretches of a take.

    Args:
        buffer: takes the key frames.
        blocks: all of the same nodes.
        fps: frames a second.
        folder: holds the key frames in files meanwhile.
        keys: frames of each node that are kept; all if not given.
    """
    tracks: defaultdict[Track, GrowingArray] = defaultdict(lambda: GrowingArray(folder))
    ends: dict[Track, np.ndarray] = {}
    for block in blocks:
        for track, values in block.items():
            key_frames = values
            if track.path == "rotation":
                key_frames = xyzw_from_matrix(values, ends.get(track))
                ends[track] = key_frames[-1]
            tracks[track].add(key_frames.astype("float32"))
    animation, shared = Animation(name="take"), dict[int, int]()
    for k, (track, values) in enumerate(tracks.items()):
        whole = values.whole()
        kept = slice(None) if keys is None else keys[track.node]
        times, number = np.arange(len(whole)) / fps, -1 if keys is None else track.node
        if number not in shared:
            shared[number] = buffer.values(times[kept])
        sampler = AnimationSampler(input=shared[number], output=buffer.values(whole[kept]))
        animation.samplers.append(sampler)
        target = AnimationChannelTarget(node=track.node, path=track.path)
        animation.channels.append(AnimationChannel(sampler=k, target=target))
    return animation


def of_nodes(
    keys: Mapping[int, np.ndarray] | None, thing: int, nodes: Sequence[int] | None = None
) -> dict[int, np.ndarray] | None:
    """Return the kept frames by nodes of a file.

    Args:
        keys: by joints, those of the object by -1; None where all frames are kept.
        thing: the object's node.
        nodes: of the joints; their own numbers if not given.
    """
    if keys is None:
        return None
    return {thing if j < 0 else j if nodes is None else nodes[j]: kept for j, kept in keys.items()}


def _moves(take: Take, thing: int) -> Moves:
    local, T = pose_locals(take), take.T_world_object
    joints = range(len(take.skeleton.names))
    return {
        **{Track(j, "translation"): local.positions[:, j] for j in take.skeleton.travelling},
        **{Track(j, "rotation"): local.rotations[:, j] for j in joints},
        Track(thing, "translation"): T[:, :3, 3],
        Track(thing, "rotation"): T[:, :3, :3],
    }


def _humanoid(take: Take) -> dict[str, Any]:
    names = BONE_NAMES[Bones.vrm].of
    bones = {names[ours]: {"node": node} for ours, node in take.human.items()}
    return {"specVersion": "1.0", "humanoid": {"humanBones": bones}}
