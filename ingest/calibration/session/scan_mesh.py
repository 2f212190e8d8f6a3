"""load_scan: the mesh that an app made of what a session saw, in that session's world."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.axes import T_ZUP_ARKIT
from ingest.formats.json_file import load_object
from ingest.mesh import load_mesh
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_GLTF = (".glb", ".gltf")
_POLYCAM = "mesh_info.json"


def load_scan(path: Path) -> ObjectMesh:
    """Read a scan's mesh in ARKit's axes: y up, metres, as its app exports it.

    Polycam turns and moves what it exports, and says how in the mesh_info.json beside it; that is
    undone.

    Raises:
        InputError: those of `load_mesh`, or "scan-damaged" for a mesh_info.json that is none.
    """
    mesh = load_mesh(path)
    vertices = np.asarray(mesh.vertices, np.float64)
    if path.suffix.lower() in _GLTF:  # which load_mesh has turned z up
        vertices = vertices @ T_ZUP_ARKIT[:3, :3]
    T = np.linalg.inv(_alignment(path.parent / _POLYCAM))
    return replace(mesh, vertices=vertices @ T[:3, :3].T + T[:3, 3])


def _alignment(path: Path) -> Float64[np.ndarray, "4 4"]:
    """What maps the session's world into Polycam's export: 16 numbers, column by column."""
    if not path.is_file():
        return np.eye(4)
    try:
        numbers = np.array(load_object(path)["alignmentTransform"], np.float64)
        T = numbers.reshape(4, 4).T
        if not np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-3):
            raise ValueError("alignmentTransform is no rotation with an offset")
    except (ValueError, KeyError, TypeError) as problem:
        raise InputError(
            "scan-damaged",
            f"Polycam's file does not say how the mesh was moved: {problem}.",
            where=str(path),
            fix="Export the raw data again.",
        ) from problem
    return T
