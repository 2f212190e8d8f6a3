"""save_mesh: an object's mesh with its colours, as GLB, PLY or OBJ."""

from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float64

from ingest.axes import T_ZUP_ARKIT
from ingest.scan.clean.clean import CleanMesh
from omomo_core.errors import InputError
from omomo_core.whole_file import whole_file

INVENTED = "_INVENTED"
"""Vertex attribute: 1 where no picture shows the surface and it only closes what was seen."""
FORMATS = (".glb", ".ply", ".obj")


def save_mesh(clean: CleanMesh, path: Path) -> None:
    """Write what `ingest.mesh.load_mesh` reads back as the same mesh; whole or not at all.

    GLB is y up by specification; the others stay z up.

    Raises:
        InputError: "mesh-format", or those of `whole_file`.
    """
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise InputError(
            "mesh-format",
            f"A scan cannot be written as {path.name}.",
            where=str(path),
            fix=f"Give a name that ends in {', '.join(FORMATS)}.",
        )
    turn = T_ZUP_ARKIT[:3, :3] if kind == ".glb" else np.eye(3)
    encoded = _trimesh(clean, turn).export(file_type=kind[1:])
    with whole_file(path) as partial:
        partial.write_bytes(encoded.encode() if isinstance(encoded, str) else bytes(encoded))


def _trimesh(clean: CleanMesh, turn: Float64[np.ndarray, "3 3"]) -> trimesh.Trimesh:
    mesh = clean.mesh
    made = trimesh.Trimesh(
        mesh.vertices @ turn,
        mesh.faces,
        vertex_normals=clean.normals @ turn,
        vertex_colors=mesh.colours,
        process=False,
    )
    made.vertex_attributes[INVENTED] = (~clean.seen).astype(np.float32)
    return made
