"""GLB (binary glTF 2.0): the skinned body and the moving object in one clip.

Follows the glTF 2.0 specification, sections 3.7.3 (skins) and 3.11 (animations).
"""

from importlib.metadata import version
from pathlib import Path

import numpy as np
import torch
import trimesh
from jaxtyping import Float, Int
from pygltflib import (
    GLTF2,
    Animation,
    AnimationChannel,
    AnimationChannelTarget,
    AnimationSampler,
    Asset,
    Attributes,
    Material,
    Mesh,
    Node,
    PbrMetallicRoughness,
    Primitive,
    Scene,
    Skin,
)

from capture_app.exports.glb_buffer import GlbBuffer
from capture_app.exports.tracks import Tracks, y_up_tracks
from omomo_core.body.model import BodyModel
from omomo_core.body.skinning import vertex_normals
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS

_BLUE = [0.16, 0.33, 0.55, 1.0]
_ORANGE = [0.85, 0.36, 0.10, 1.0]
_CREASE = np.radians(30.0)
"""Neighbouring faces of the object that meet at a sharper angle than this keep a hard edge."""
_BODY_MATERIAL, _OBJECT_MATERIAL = 0, 1


def write_glb(
    path: Path, human: HumanMotion, object_motion: ObjectMotion, body: BodyModel, clip: str = "take"
) -> None:
    """Write a motion as one file that Blender, Unity, Unreal, three.js and model viewers open.

    Nodes: the 52 joints by their names in ALL_JOINTS (root motion on "pelvis"), "body" (the skin)
    and "object". The clip has 30 key frames a second; the turn of the world from z up to y up is
    part of them. At rest the skeleton stands in the T-pose on the floor, the object at its first
    pose. Metres, seconds.

    Args:
        path: the .glb file to write.
        human: world z up, metres.
        object_motion: as many frames as `human`.
        body: its bones must be those that `human` moves.
        clip: name of the animation.
    """
    gltf = GLTF2(asset=_asset(body))
    buffer = GlbBuffer(gltf)
    tracks = y_up_tracks(human, object_motion)
    gltf.materials = [_material("body", _BLUE), _material("object", _ORANGE)]
    gltf.meshes = [_body_mesh(buffer, body), _object_mesh(buffer, object_motion.mesh)]
    gltf.nodes = _joint_nodes(body)
    figure, thing = len(gltf.nodes), len(gltf.nodes) + 1
    gltf.nodes += [Node(name="body", mesh=0, skin=0), _object_node(tracks)]
    gltf.skins = [_skin(buffer, body)]
    gltf.animations = [_animation(buffer, tracks, thing, clip)]
    gltf.scenes = [Scene(nodes=[0, figure, thing])]
    gltf.scene = 0
    buffer.finish()
    path.write_bytes(b"".join(gltf.save_to_bytes()))


def _asset(body: BodyModel) -> Asset:
    return Asset(
        version="2.0",
        generator=f"omocap {version('omocap')}",
        copyright=body.credit,
        extras={"body": body.name, "credit": body.credit},
    )


def _material(name: str, colour: list[float]) -> Material:
    surface = PbrMetallicRoughness(baseColorFactor=colour, metallicFactor=0.0, roughnessFactor=0.7)
    # Scanned and hand-made meshes have holes and flipped faces: show both sides.
    return Material(name=name, pbrMetallicRoughness=surface, doubleSided=True)


def _body_mesh(buffer: GlbBuffer, body: BodyModel) -> Mesh:
    joints, weights = strongest_influences(body)
    vertices = _grounded(body, body.vertices)
    normals = _unit(vertex_normals(body.vertices, body.faces).numpy())
    attributes = Attributes(
        POSITION=buffer.vertices(vertices),
        NORMAL=buffer.vertices(normals),
        JOINTS_0=buffer.vertices(joints, "uint8"),
        WEIGHTS_0=buffer.vertices(weights),
    )
    indices = buffer.indices(body.faces.numpy())
    return Mesh(
        name="body",
        primitives=[Primitive(attributes=attributes, indices=indices, material=_BODY_MATERIAL)],
    )


def _object_mesh(buffer: GlbBuffer, mesh: ObjectMesh) -> Mesh:
    source = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    shaded = trimesh.graph.smooth_shade(source, angle=_CREASE)
    attributes = Attributes(
        POSITION=buffer.vertices(np.asarray(shaded.vertices)),
        NORMAL=buffer.vertices(_unit(np.asarray(shaded.vertex_normals))),
    )
    indices = buffer.indices(np.asarray(shaded.faces))
    return Mesh(
        name=mesh.name,
        primitives=[Primitive(attributes=attributes, indices=indices, material=_OBJECT_MATERIAL)],
    )


def _joint_nodes(body: BodyModel) -> list[Node]:
    """The skeleton at rest: no rotations, each joint at its offset from its parent."""
    rest = _grounded(body, body.rest_joints)
    nodes: list[Node] = []
    for j, name in enumerate(ALL_JOINTS):
        offset = rest[j] - rest[ALL_PARENTS[j]] if j else rest[0]
        children = [k for k, parent in enumerate(ALL_PARENTS) if parent == j]
        nodes.append(Node(name=name, translation=offset.tolist(), children=children))
    return nodes


def _object_node(tracks: Tracks) -> Node:
    return Node(
        name="object",
        mesh=1,
        translation=tracks.object_position[0].tolist(),
        rotation=tracks.object_rotation[0].tolist(),
    )


def _skin(buffer: GlbBuffer, body: BodyModel) -> Skin:
    matrices = np.tile(np.eye(4), (len(ALL_JOINTS), 1, 1))
    matrices[:, :3, 3] = -_grounded(body, body.rest_joints)
    joints = list(range(len(ALL_JOINTS)))
    return Skin(
        name="skeleton", skeleton=0, joints=joints, inverseBindMatrices=buffer.values(matrices)
    )


def _animation(buffer: GlbBuffer, tracks: Tracks, thing: int, clip: str) -> Animation:
    times = buffer.values(tracks.times)
    moves = [
        (0, "translation", tracks.root),
        *((j, "rotation", tracks.rotations[:, j]) for j in range(len(ALL_JOINTS))),
        (thing, "translation", tracks.object_position),
        (thing, "rotation", tracks.object_rotation),
    ]
    animation = Animation(name=clip)
    for k, (node, what, values) in enumerate(moves):
        animation.samplers.append(AnimationSampler(input=times, output=buffer.values(values)))
        target = AnimationChannelTarget(node=node, path=what)
        animation.channels.append(AnimationChannel(sampler=k, target=target))
    return animation


def strongest_influences(
    body: BodyModel, count: int = 4
) -> tuple[Int[np.ndarray, "verts count"], Float[np.ndarray, "verts count"]]:
    """The joints that move each vertex most, and their weights summing to 1.

    Four, because readers need not support more. Unused places hold joint 0 with weight 0.
    """
    weights = torch.zeros(len(body.vertices), len(ALL_JOINTS))
    weights.scatter_add_(1, body.skin_joints.long(), body.skin_weights.float())
    kept, joints = weights.topk(count, dim=1)
    kept = kept / kept.sum(dim=1, keepdim=True)
    return torch.where(kept > 0, joints, 0).numpy(), kept.numpy()


def _grounded(body: BodyModel, points: torch.Tensor) -> Float[np.ndarray, "points 3"]:
    """The rest pose moved until the pelvis is over the origin and the soles are on the floor."""
    pelvis = body.rest_joints[0]
    feet = body.vertices[:, 1].min()
    return (points - torch.stack([pelvis[0], feet, pelvis[2]])).double().numpy()


def _unit(normals: np.ndarray) -> np.ndarray:
    """Unit length as float32 keeps it; a normal that is nothing (a collapsed face) points up."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 1e-6, normals / np.maximum(length, 1e-6), [0.0, 1.0, 0.0])
