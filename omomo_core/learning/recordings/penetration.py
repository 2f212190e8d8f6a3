"""How deep an object's surface is inside somebody's flesh.

Asked this way round the object may be an open scan: only the body's skin must be closed.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from omomo_core.body.kinematics import full_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.skinning import skin, vertex_normals
from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import ObjectMotion
from omomo_core.skeleton import ALL_JOINTS

Depth = dict[str, Float[np.ndarray, " frames"]]
"""Metres, for "trunk", "leg", "arm" and "hand"; 0 where nothing is inside."""

PARTS = ("trunk", "leg", "arm", "hand")
_SURFACE_POINTS = 3000
_EVERY_VERTEX = 3


def body_in_object(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    motion: ObjectMotion,
    stride: int,
) -> Depth:
    """Deepest point of the object's surface inside each part of the body, frame by frame.

    Args:
        body: with a closed skin.
        root, rotations: of every `stride`-th frame.
        motion: of all frames.
        stride: between the frames that are measured.
    """
    points = sample_surface(motion.mesh, _SURFACE_POINTS).points
    part_of = _part_of_vertices(body)[::_EVERY_VERTEX]
    depth = {part: np.zeros(len(root)) for part in PARTS}
    for k, T in enumerate(motion.T_world_object[::stride]):
        vertices, normals = _skin(body, root[k], rotations[k])
        world = points @ T[:3, :3].T + T[:3, 3]
        inside = world[_within(world, vertices)]
        if len(inside) == 0:
            continue
        distance, nearest = KDTree(vertices[::_EVERY_VERTEX]).query(inside)
        nearest_vertex = nearest * _EVERY_VERTEX
        beyond = ((inside - vertices[nearest_vertex]) * normals[nearest_vertex]).sum(-1)
        # The way out along the normal; the straight distance is longer between two vertices.
        deep = np.where(beyond < 0.0, np.minimum(distance, -beyond), 0.0)
        for number, part in enumerate(PARTS):
            depth[part][k] = deep[part_of[nearest] == number].max(initial=0.0)
    return depth


def _skin(
    body: BodyModel, root: Float[np.ndarray, " 3"], rotations: Float[np.ndarray, "22 3 3"]
) -> tuple[Float[np.ndarray, "verts 3"], Float[np.ndarray, "verts 3"]]:
    at, turned = torch.as_tensor(root).float(), torch.as_tensor(rotations).float()
    with torch.inference_mode():
        vertices = skin(body, *full_kinematics(body, at, turned, body.relaxed_fingers))
        return vertices.numpy(), vertex_normals(vertices, body.faces).numpy()


def _within(
    points: Float[np.ndarray, "points 3"], vertices: Float[np.ndarray, "verts 3"]
) -> Bool[np.ndarray, " points"]:
    """Points in the box around the body: most of a large object is not."""
    return ((points > vertices.min(axis=0)) & (points < vertices.max(axis=0))).all(axis=1)


def _part_of_vertices(body: BodyModel) -> Int[np.ndarray, " verts"]:
    strongest = body.skin_weights.argmax(dim=1, keepdim=True)
    bone = body.skin_joints.gather(1, strongest)[:, 0].numpy()
    return np.array([PARTS.index(_part(name)) for name in ALL_JOINTS])[bone]


def _part(name: str) -> str:
    bare = name.removeprefix("left_").removeprefix("right_")
    if bare in ("hip", "knee", "ankle", "foot"):
        return "leg"
    if bare in ("shoulder", "elbow"):
        return "arm"
    return "trunk" if bare == name or bare == "collar" else "hand"
