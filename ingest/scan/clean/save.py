"""save_mesh: an object's mesh with its colours, as GLB, PLY or OBJ."""

from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float64, Int64
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from ingest.axes import T_ZUP_ARKIT
from ingest.scan.clean.clean import CleanMesh
from omomo_core.errors import InputError
from omomo_core.motion import Texture
from omomo_core.whole_file import whole_file

INVENTED = "_INVENTED"
"""Vertex attribute: 1 where no picture shows the surface and it only closes what was seen."""
_EXACT = 1e6
"""Parts of the atlas's side that tell two places apart."""
FORMATS = (".glb", ".ply", ".obj")


def save_mesh(clean: CleanMesh, path: Path) -> None:
    """Write what `ingest.mesh.load_mesh` reads back as the same mesh; whole or not at all.

    GLB is y up by specification and holds the texture where there is one; the others stay z up and hold
    the colours of the vertices.

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
    encoded = _trimesh(clean, turn, kind == ".glb").export(file_type=kind[1:])
    with whole_file(path) as partial:
        partial.write_bytes(encoded.encode() if isinstance(encoded, str) else bytes(encoded))


def _trimesh(clean: CleanMesh, turn: Float64[np.ndarray, "3 3"], textured: bool) -> trimesh.Trimesh:
    mesh = clean.mesh
    number, faces, visual = np.arange(len(mesh.vertices)), mesh.faces, None
    if textured and mesh.texture is not None:
        number, faces, visual = _split(mesh.faces, mesh.texture)
    made = trimesh.Trimesh(
        (mesh.vertices @ turn)[number],
        faces,
        vertex_normals=(clean.normals @ turn)[number],
        vertex_colors=mesh.colours if visual is None else None,
        visual=visual,
        process=False,
    )
    made.vertex_attributes[INVENTED] = (~clean.seen[number]).astype(np.float32)
    return made


def _split(
    faces: Int64[np.ndarray, "faces 3"], texture: Texture
) -> tuple[Int64[np.ndarray, " split"], Int64[np.ndarray, "faces 3"], TextureVisuals]:
    """Vertices that lie at several places of the atlas, apart: whose they are, faces, and the look."""
    uv = texture.uv.reshape(-1, 2)
    corners = np.concatenate([faces.reshape(-1, 1), np.rint(uv * _EXACT)], axis=1).astype(np.int64)
    _, first, number = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    material = PBRMaterial(
        baseColorTexture=Image.fromarray(texture.image), metallicFactor=0.0, roughnessFactor=0.9
    )
    # trimesh counts v from below.
    places = uv[first] * [1.0, -1.0] + [0.0, 1.0]
    look = TextureVisuals(uv=places, material=material)
    return corners[first, 0], number.reshape(-1, 3).astype(np.int64), look
