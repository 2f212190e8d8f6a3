"""A motion written into the character's own GLB or VRM: its meshes, materials and names stay as they are."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from capture_app.exports.exported_take import Take, placed
from capture_app.exports.glb import (
    GlbBuffer,
    Moves,
    Track,
    animation_of,
    object_material,
    object_mesh,
    object_node,
    of_nodes,
)
from capture_app.exports.reduced_keys import reduced_keys
from capture_app.exports.target_skeleton import Character, global_pose
from omomo_core.geometry.rotations import xyzw_from_matrix


def write_character(
    path: Path, character: Character, take: Take, *, reduce_to: float | None = None
) -> None:
    """Write the character's file with the object and one more animation, which comes first.

    Args:
        path: the .glb file to write.
        character: the file, and its node of each joint of the take.
        take: of that character's bones, in our own world.
        reduce_to: leave out keys while joints stay that near to where they are, metres.
    """
    keys = None if reduce_to is None else reduced_keys(take, reduce_to)
    take, gltf, nodes = placed(take, "y", "m"), character.gltf, character.scene["nodes"]
    buffer = GlbBuffer(gltf, gltf.binary_blob() or b"")
    rig = _Rig.of(character)
    gltf.materials.append(object_material(buffer, take.mesh.texture))
    gltf.meshes.append(object_mesh(buffer, take.mesh, len(gltf.materials) - 1))
    gltf.nodes.append(object_node(take, take.spans, len(gltf.meshes) - 1))
    thing = len(gltf.nodes) - 1
    moves, kept = rig.moves(take, thing), of_nodes(keys, thing, character.nodes)
    gltf.animations.insert(0, animation_of(buffer, [moves], take.fps, path.parent, kept))
    for node in character.nodes:
        _without_matrix(nodes[node])
    buffer.write(path, _with_added(character, buffer.scene(), thing))


def _with_added(character: Character, made: dict[str, Any], thing: int) -> dict[str, Any]:
    """Return the character's own JSON with what was added to the scene, and the object's node at its top."""
    scene = dict(character.scene)
    for part in ("accessors", "bufferViews", "images", "materials", "meshes", "nodes", "textures"):
        old = scene.get(part, [])
        if added := made.get(part, [])[len(old) :]:
            scene[part] = [*old, *added]
    scene["animations"] = [made["animations"][0], *scene.get("animations", [])]
    scene["buffers"] = [made["buffers"][0], *scene.get("buffers", [])[1:]]
    top = scene["scenes"][scene.get("scene", 0)]
    if character.metres != 1.0:
        # glTF is in metres.
        above = {"name": "metres", "scale": [character.metres] * 3, "children": top["nodes"]}
        scene["nodes"].append(above)
        top["nodes"] = [len(scene["nodes"]) - 1]
    top["nodes"] = [*top["nodes"], thing]
    return scene


def _without_matrix(node: dict[str, Any]) -> None:
    """Give a node translation, rotation and scale in place of a matrix, which cannot be animated."""
    if "matrix" not in node:
        return
    T = np.array(node.pop("matrix"), float).reshape(4, 4).T
    scale = np.linalg.norm(T[:3, :3], axis=0)
    turn = xyzw_from_matrix((T[:3, :3] / scale)[None])[0]
    node |= {"translation": T[:3, 3].tolist(), "rotation": turn.tolist(), "scale": scale.tolist()}


@dataclass(frozen=True)
class _Rig:
    """The nodes of a character's joints, and what they hang on."""

    nodes: tuple[int, ...]
    parents: tuple[int, ...]
    """Joint that each hangs on; -1 where it is a node that does not move."""
    T_world_above: Float[np.ndarray, "joints 4 4"]
    """Rest pose of the node that each hangs on, scales included; metres."""

    @staticmethod
    def of(character: Character) -> "_Rig":
        gltf, nodes = character.gltf, character.nodes
        above = {c: n for n, node in enumerate(gltf.nodes) for c in node.children or []}
        top = np.diag([character.metres] * 3 + [1.0])
        at = [
            top @ (global_pose(gltf, above, above[n]) if n in above else np.eye(4)) for n in nodes
        ]
        joint = {n: j for j, n in enumerate(nodes)}
        return _Rig(nodes, tuple(joint.get(above.get(n, -1), -1) for n in nodes), np.array(at))

    def moves(self, take: Take, thing: int) -> Moves:
        """Return what moves the joints' nodes, and the object's."""
        scale = np.linalg.norm(self.T_world_above[:, :3, :3], axis=1)
        T, moved = take.T_world_object, Moves()
        for j, node in enumerate(self.nodes):
            T_above = self._above(take, j, scale[j])
            turned = T_above[:, :3, :3].swapaxes(1, 2)
            moved[Track(node, "rotation")] = turned @ take.rotations[:, j]
            if j in take.skeleton.travelling:
                way = take.positions[:, j] - T_above[:, :3, 3]
                moved[Track(node, "translation")] = (turned @ way[..., None])[..., 0] / scale[
                    j
                ].mean()
        of_thing = {"translation": T[:, :3, 3], "rotation": T[:, :3, :3]}
        return moved | {Track(thing, path): values for path, values in of_thing.items()}

    def _above(
        self, take: Take, j: int, scale: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "frames 4 4"]:
        """Return the pose, without its scale, of what a joint hangs on."""
        T_above = np.tile(self.T_world_above[j], (len(take.positions), 1, 1))
        T_above[:, :3, :3] /= scale
        if (parent := self.parents[j]) >= 0:
            T_above[:, :3, :3], T_above[:, :3, 3] = (
                take.rotations[:, parent],
                take.positions[:, parent],
            )
        return T_above
