"""Surfaces for the eye: the person's with four bones a vertex, the object's with few enough faces."""

import fast_simplification
import numpy as np
import torch
from jaxtyping import Float, Int

from capture_app.exports.own_bones import strongest_influences
from capture_app.exports.shading import creased
from omomo_core.body.model import BodyModel
from omomo_core.body.skinning import vertex_normals
from omomo_core.motion import ObjectMesh

MOST_FACES = 50_000
"""Of an object that is looked at."""

Arrays = dict[str, np.ndarray]


def body_arrays(body: BodyModel) -> Arrays:
    """The body at rest: `body_vertices`, `body_normals`, `body_faces`, `skin_*`, `rest_joints`."""
    joints, weights = strongest_influences(body)
    normals = vertex_normals(body.vertices, body.faces).numpy()
    return {
        "body_vertices": body.vertices.numpy().astype(np.float32),
        "body_normals": _bytes_of(normals),
        "body_faces": _indices(body.faces.numpy(), len(body.vertices)),
        "skin_joints": joints.astype(np.uint8),
        "skin_weights": np.rint(255 * weights).astype(np.uint8),
        "rest_joints": body.rest_joints.to(torch.float32).numpy(),
    }


def object_arrays(mesh: ObjectMesh) -> tuple[Arrays, bool]:
    """Return `object_vertices`, `object_normals`, `object_faces` in the object's frame, and if decimated."""
    shown = _light(mesh)
    vertices, normals, faces = creased(shown)
    arrays: Arrays = {
        "object_vertices": vertices.astype(np.float32),
        "object_normals": _bytes_of(normals),
        "object_faces": _indices(faces, len(vertices)),
    }
    return arrays, shown is not mesh


def _light(mesh: ObjectMesh) -> ObjectMesh:
    if len(mesh.faces) <= MOST_FACES:
        return mesh
    made = fast_simplification.simplify(
        mesh.vertices.astype(np.float64), mesh.faces.astype(np.int32), target_count=MOST_FACES
    )
    vertices, faces = made[0], made[1]
    return ObjectMesh(np.asarray(vertices, float), np.asarray(faces, np.int64), mesh.name)


def _bytes_of(normals: Float[np.ndarray, "n 3"]) -> np.ndarray:
    return np.rint(127 * normals.clip(-1, 1)).astype(np.int8)


def _indices(faces: Int[np.ndarray, "faces 3"], count: int) -> np.ndarray:
    return faces.astype(np.uint16 if count <= np.iinfo(np.uint16).max else np.uint32)
