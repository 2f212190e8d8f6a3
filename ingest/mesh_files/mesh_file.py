"""read_mesh_file: what is drawn of an OBJ, PLY, STL, GLB or glTF file."""

from collections.abc import Callable
from pathlib import Path

from ingest.mesh_files.file_parts import MAX_FACES, ReadMesh, decoding
from ingest.mesh_files.gltf_surface import read_gltf
from ingest.mesh_files.obj_file import read_obj
from ingest.mesh_files.ply_file import read_ply
from ingest.mesh_files.stl_file import read_stl

_READERS: dict[str, Callable[[Path, int], ReadMesh]] = {
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
    ".glb": read_gltf,
    ".gltf": read_gltf,
}
FORMATS = tuple(_READERS)
"""Endings of the names of what is read."""
Y_UP = (".glb", ".gltf")
"""Those whose y axis is up by specification."""


def read_mesh_file(path: Path, most: int = MAX_FACES) -> ReadMesh:
    """Read a file by the reader of its ending, in its own axes and unit.

    Args:
        path: an existing file of FORMATS.
        most: triangles that are read.

    Raises:
        InputError: "mesh-unreadable" for a damaged file, or what its reader names.
    """
    with decoding(path):
        return _READERS[path.suffix.lower()](path, most)
