"""Surfaces for the eye: the person's with four bones a vertex, the object's with few enough faces."""

import fast_simplification
import numpy as np
import torch
from jaxtyping import Float, Int

from capture_app.exports.own_bones import strongest_influences
from capture_app.exports.shading import creased
from capture_app.picture_bytes import encoded
from omomo_core.body.kinematics import vertex_normals
from omomo_core.body.model import BodyModel
from omomo_core.motion import ObjectMesh

MOST_FACES = 50_000
"""Of an object that is looked at."""
MOST_TEXTURED = 4 * MOST_FACES
"""Of one with a texture, which it loses when it gets fewer faces."""

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
    surface = creased(shown)
    arrays: Arrays = {
        "object_vertices": surface.vertices.astype(np.float32),
        "object_normals": _bytes_of(surface.normals),
        "object_faces": _indices(surface.faces, len(surface.vertices)),
    }
    if surface.uv is not None and shown.texture is not None:
        picture = encoded(shown.texture.image)
        arrays["object_uv"] = surface.uv.astype(np.float32)
        arrays[f"object_{picture.ending}"] = np.frombuffer(picture.data, np.uint8)
    return arrays, shown is not mesh


def _light(mesh: ObjectMesh) -> ObjectMesh:
    if len(mesh.faces) <= (MOST_FACES if mesh.texture is None else MOST_TEXTURED):
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
