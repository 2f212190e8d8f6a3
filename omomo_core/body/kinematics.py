"""Forward kinematics and skinning of the body, turns from rest poses, and soles of shoes.

Forward kinematics. Rotations are global and identity at rest, so every body shares them.

A joint sits at its parent plus the parent's global rotation of the rest offset. The whole tree is
one matrix product: the 0/1 matrix of ancestors sums the rotated bones from the root to each joint.

Limbs are turned along ours, feet only about the vertical: a foot that stands flat on one skeleton stands
flat on the other, however high its ankle is. Collars are turned until the shoulders are where ours are, seen
from the chest: where collars begin differs from skeleton to skeleton, and SMPL's T-pose raises the
shoulders. The trunk keeps its shape.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.body.body_config import SOLE
from omomo_core.body.model import BodyModel
from omomo_core.geometry.transforms import shortest_turn
from omomo_core.skeleton import (
    ALL_PARENTS,
    BODY_PARENTS,
    MODEL_ABOVE,
    MODEL_PARENTS,
    PALM_JOINTS,
    joint,
)

WRISTS = (joint("left_wrist"), joint("right_wrist"))
MODEL_REST = (*range(22), *PALM_JOINTS)
"""Indices of the model's 24 joints among a body's 52."""


def _ancestors(parents: Sequence[int]) -> Float[Tensor, "joints joints"]:
    """Return a matrix with 1 where column k is joint j or one of its ancestors, the root excluded."""
    matrix = torch.zeros(len(parents), len(parents))
    for j, parent in enumerate(parents):
        if parent >= 0:
            matrix[j] = matrix[parent]
            matrix[j, j] = 1.0
    return matrix


_MODEL_ANCESTORS = _ancestors(MODEL_PARENTS)
_ALL_ANCESTORS = _ancestors(ALL_PARENTS)


def forward_kinematics(
    body: BodyModel, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
) -> Float[Tensor, "*b 24 3"]:
    """Return the joints of the model: the 22 body joints, then the left and right palm.

    Args:
        body: whose bone lengths to use.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint of the body joints.

    Returns:
        Joint positions, world, metres; the palms turn with their wrists.
    """
    rest = body.rest_joints[list(MODEL_REST)]
    return _place(root, rotations, rest, MODEL_PARENTS, _MODEL_ANCESTORS)


def joints_of(
    body: BodyModel,
    root: Float[np.ndarray, "*b 3"],
    rotations: Float[np.ndarray, "*b 22 3 3"],
) -> Float[np.ndarray, "*b 24 3"]:
    """Return what `forward_kinematics` does, for numpy arrays."""
    return forward_kinematics(
        body, torch.as_tensor(root, dtype=torch.float64), torch.as_tensor(rotations)
    ).numpy()


def full_kinematics(
    body: BodyModel,
    root: Float[Tensor, "*b 3"],
    rotations: Float[Tensor, "*b 22 3 3"],
    fingers: Float[Tensor, "*b 30 3 3"],
) -> tuple[Float[Tensor, "*b 52 3"], Float[Tensor, "*b 52 3 3"]]:
    """Return every joint of the body, fingers included.

    Args:
        body: whose bone lengths to use.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint of the body joints.
        fingers: rotation of each finger joint relative to its parent.

    Returns:
        Joint positions (world, metres) and global rotations in the order of ALL_JOINTS.
    """
    R_global = torch.cat([rotations, _finger_rotations(rotations, fingers)], dim=-3)
    return _place(root, R_global, body.rest_joints, ALL_PARENTS, _ALL_ANCESTORS), R_global


def global_rotations(local: Float[Tensor, "*b 22 3 3"]) -> Float[Tensor, "*b 22 3 3"]:
    """R_world_joint of the body joints from rotations relative to the parents (pelvis: to the world)."""
    turned = [local[..., 0, :, :]]
    for j in range(1, len(BODY_PARENTS)):
        turned.append(turned[BODY_PARENTS[j]] @ local[..., j, :, :])
    return torch.stack(turned, dim=-3)


def _place(
    root: Float[Tensor, "*b 3"],
    rotations: Float[Tensor, "*b turning 3 3"],
    rest: Float[Tensor, "joints 3"],
    parents: Sequence[int],
    ancestors: Float[Tensor, "joints joints"],
) -> Float[Tensor, "*b joints 3"]:
    """Rotate each bone of the rest pose by its parent and sum the bones along the tree."""
    above = [max(parent, 0) for parent in parents]
    offsets = (rest - rest[above]).to(rotations)
    bones = torch.einsum("...jxy,jy->...jx", rotations[..., above, :, :], offsets)
    return root[..., None, :] + ancestors.to(rotations) @ bones


def _finger_rotations(
    rotations: Float[Tensor, "*b 22 3 3"], fingers: Float[Tensor, "*b 30 3 3"]
) -> Float[Tensor, "*b 30 3 3"]:
    """Global rotations of the finger joints: three links after the wrist, ten fingers at once."""
    links = fingers.unflatten(-3, (2, 5, 3))
    above = rotations[..., list(WRISTS), None, :, :]
    turned: list[Tensor] = []
    for k in range(3):
        above = above @ links[..., k, :, :]
        turned.append(above)
    return torch.stack(turned, dim=-3).flatten(-5, -3)


_CHUNK = 32
"""Frames skinned at once: bounds memory to about 100 MB however long the take is."""


def skin(
    body: BodyModel, joints: Float[Tensor, "*b 52 3"], R_global: Float[Tensor, "*b 52 3 3"]
) -> Float[Tensor, "*b verts 3"]:
    """Move the body's vertices with its joints.

    Args:
        body: rest vertices and skin weights.
        joints: joint positions, world, metres (from `full_kinematics`).
        R_global: global R_world_joint; identity is the rest pose.

    Returns:
        Vertex positions, world, metres.
    """
    weights = _weight_matrix(body).to(R_global)
    rest = body.rest_joints.to(R_global)
    shift = joints - (R_global @ rest[:, :, None])[..., 0]
    T = torch.cat([R_global, shift[..., None]], dim=-1).reshape(-1, 52, 12)
    vertices = body.vertices.to(R_global)
    chunks = [_blend(weights, part, vertices) for part in T.split(_CHUNK)]
    return torch.cat(chunks).reshape(*joints.shape[:-2], -1, 3)


def vertex_normals(
    vertices: Float[Tensor, "*b verts 3"], faces: Int[Tensor, "faces 3"]
) -> Float[Tensor, "*b verts 3"]:
    """Unit normals: the area-weighted mean of the faces around each vertex.

    Args:
        vertices: positions, metres.
        faces: triangles, counter-clockwise seen from outside.
    """
    corners = faces.T.reshape(-1)
    frames = [
        _summed_normals(v, faces, corners) for v in vertices.reshape(-1, *vertices.shape[-2:])
    ]
    summed = torch.stack(frames).reshape(vertices.shape)
    return torch.nn.functional.normalize(summed, dim=-1, eps=1e-20)


def _summed_normals(
    vertices: Float[Tensor, "verts 3"],
    faces: Int[Tensor, "faces 3"],
    corners: Int[Tensor, " corners"],
) -> Float[Tensor, "verts 3"]:
    """One frame at a time: three times faster than all at once, which outgrows the cache."""
    a, b, c = vertices[faces].unbind(1)
    normals = torch.linalg.cross(b - a, c - a, dim=-1)
    return torch.zeros_like(vertices).index_add(0, corners, normals.repeat(3, 1))


def _weight_matrix(body: BodyModel) -> Float[Tensor, "verts 52"]:
    matrix = torch.zeros(len(body.vertices), 52, dtype=body.skin_weights.dtype)
    return matrix.scatter_add(1, body.skin_joints.long(), body.skin_weights)


def _blend(
    weights: Float[Tensor, "verts 52"],
    T: Float[Tensor, "frames 52 12"],
    vertices: Float[Tensor, "verts 3"],
) -> Float[Tensor, "frames verts 3"]:
    """Blend the joints' 3x4 transforms by weight and apply them."""
    blended = (weights @ T).unflatten(-1, (3, 4))
    return (blended[..., :3] @ vertices[:, :, None])[..., 0] + blended[..., 3]


ANKLES = (joint("left_ankle"), joint("right_ankle"))
TOES = (joint("left_foot"), joint("right_foot"))


def sole_points(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
) -> Float[np.ndarray, "frames 4 3"]:
    """Return left heel, right heel, left and right ball of the foot, on the soles; world, metres."""
    joints = forward_kinematics(body, torch.as_tensor(root), torch.as_tensor(rotations)).numpy()
    rest = body.rest_joints.double().numpy()
    floor = float(body.vertices[:, 1].min())
    points: list[Float[np.ndarray, "frames 3"]] = []
    for j in ANKLES + TOES:
        behind = -SOLE.heel_behind_ankle if j in ANKLES else 0.0
        below = np.array([0.0, floor - rest[j, 1], behind])
        points.append(joints[:, j] + rotations[:, j] @ below)
    return np.stack(points, axis=1)


LIMBS = {1: 4, 2: 5, 4: 7, 5: 8, 7: 10, 8: 11, 16: 18, 17: 19, 18: 20, 19: 21, 20: 22, 21: 23}
"""Joints that drive one straight bone, and the end of that bone."""
COLLARS = {13: 16, 14: 17}
"""Collars and their shoulders; both collars begin at the chest."""

Offsets = Float[np.ndarray, "24 3"]
"""From each joint's parent to it, at rest, in axes that all joints share, metres."""


def rest_offsets(body: BodyModel) -> Offsets:
    """Return the rest offsets of one of our bodies, in our rest axes."""
    rest = body.rest_joints.double().numpy()[list(MODEL_REST)]
    return rest - rest[list(MODEL_ABOVE)]


def rest_turns(body: BodyModel, theirs: Offsets) -> Float[np.ndarray, "22 3 3"]:
    """Return the smallest rotation of each joint that takes our rest directions to another skeleton's.

    A rotation R of one of their joints is R @ turn in our terms, and a bone of theirs turn^T @ offset.

    Args:
        body: ours.
        theirs: in our rest axes (x left, y up, z forward), but of any size.
    """
    ours, turns = rest_offsets(body), np.tile(np.eye(3), (22, 1, 1))
    for start, end in LIMBS.items():
        axes = [1.0, 0.0, 1.0] if start in ANKLES else [1.0, 1.0, 1.0]
        turns[start] = shortest_turn(ours[end] * axes, theirs[end] * axes)
    for collar, shoulder in COLLARS.items():
        wanted = _onto_line(ours[collar] + ours[shoulder], theirs[collar], theirs[shoulder])
        turns[collar] = shortest_turn(wanted, theirs[shoulder])
    return turns


def _onto_line(
    line: Float[np.ndarray, "3"], start: Float[np.ndarray, "3"], bone: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3"]:
    """Return the bone, turned about its start until it ends on a line from the origin, or points to it."""
    along = line / np.linalg.norm(line)
    way = (along @ start) * along - start
    farther = np.sqrt(max(float(bone @ bone - way @ way), 0.0))
    return way + farther * along
