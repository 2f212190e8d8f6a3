"""Normals of the object's surface: smooth, with hard edges where faces meet at an angle."""

import numpy as np
import trimesh
from jaxtyping import Float, Int

from capture_app.exports.own_bones import unit_normals
from omomo_core.motion import ObjectMesh

_CREASE = np.radians(30.0)
"""Neighbouring faces that meet at a sharper angle than this keep a hard edge."""


def creased(
    mesh: ObjectMesh,
) -> tuple[Float[np.ndarray, "v 3"], Float[np.ndarray, "v 3"], Int[np.ndarray, "faces 3"]]:
    """Vertices (doubled along hard edges), their unit normals, and faces, in the mesh's frame."""
    source = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    shaded = trimesh.graph.smooth_shade(source, angle=_CREASE)
    normals = unit_normals(np.asarray(shaded.vertex_normals))
    return np.asarray(shaded.vertices), normals, np.asarray(shaded.faces)
