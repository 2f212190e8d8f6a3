"""ready_mesh: a mesh that another app made, put on its base in the middle of its own frame."""

from typing import Any

import igl
import numpy as np
import trimesh

from ingest.report.check import Check
from ingest.scan.clean.clean import CleanMesh
from ingest.scan.types import ScanMesh


def ready_mesh(mesh: ScanMesh) -> CleanMesh:
    """The same surface with its base at z = 0 and its footprint's middle at the origin.

    Vertices at one place become one. The axes stay as they are, and so do holes.
    """
    merged = trimesh.Trimesh(
        mesh.vertices, mesh.faces, vertex_colors=mesh.colours, process=False, validate=False
    )
    merged.merge_vertices(merge_tex=True, merge_norm=True)
    merged.remove_unreferenced_vertices()
    vertices, faces = np.asarray(merged.vertices, np.float64), np.asarray(merged.faces, np.int64)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    T = np.eye(4)
    T[:3, 3] = [*(low + high)[:2] / 2, low[2]]
    rims = len(igl.boundary_loop_all(faces))
    visual: Any = merged.visual
    colours = np.asarray(visual.vertex_colors, np.uint8)[:, :3]
    return CleanMesh(
        mesh=ScanMesh(
            vertices - T[:3, 3],
            faces,
            None if mesh.colours is None else colours,
            mesh.name,
            (*mesh.notes, _closed(rims)),
            mesh.texture,
        ),
        normals=np.asarray(igl.per_vertex_normals(vertices, faces), np.float64),
        T_world_object=T,
        seen=np.ones(len(vertices), np.bool_),
        watertight=rims == 0,
    )


def _closed(rims: int) -> Check:
    if rims == 0:
        return Check("closed", "ok", "The surface is closed.")
    message = f"The surface has {rims} holes; a motion can be made with it all the same."
    return Check("closed", "ok", message)
