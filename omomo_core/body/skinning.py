"""Linear blend skinning and vertex normals."""

import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.body.model import BodyModel

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
