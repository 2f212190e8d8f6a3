"""The meshes of a USD or USDZ file, such as Object Capture and RealityScan write."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from ingest.axes import T_ZUP_ARKIT
from ingest.usd import open_stage, pxr, reading_usd, triangles_of

SUFFIXES = (".usdz", ".usd", ".usdc", ".usda")


def usd_parts(path: Path) -> tuple[dict[str, trimesh.Trimesh], float]:
    """The meshes of a stage by the names of their prims, in the world turned z up, and its unit.

    Colours are those of the vertices (primvars:displayColor); textures are not read.

    Returns:
        Meshes in the stage's unit, and that in metres.

    Raises:
        InputError: of `open_stage`.
    """
    with reading_usd(path):
        return _parts(path)


def _parts(path: Path) -> tuple[dict[str, trimesh.Trimesh], float]:
    geom, stage = pxr("UsdGeom"), open_stage(path)
    up_y = geom.GetStageUpAxis(stage) == geom.Tokens.y
    R = T_ZUP_ARKIT[:3, :3] if up_y else np.eye(3)
    cache = geom.XformCache()
    prims = stage.Traverse(pxr("Usd").TraverseInstanceProxies())
    parts = {
        str(prim.GetPath()): _part(geom.Mesh(prim), cache.GetLocalToWorldTransform(prim), R)
        for prim in prims
        if prim.IsA(geom.Mesh)
    }
    return parts, float(geom.GetStageMetersPerUnit(stage))


def _part(mesh: Any, placed: Any, R: np.ndarray) -> trimesh.Trimesh:
    points, faces = triangles_of(mesh, 0.0)
    # USD multiplies row vectors from the left.
    T = np.asarray(placed, np.float64)
    vertices = (points @ T[:3, :3] + T[3, :3]) @ R.T
    colours = np.asarray(mesh.GetDisplayColorAttr().Get() or [], np.float64).reshape(-1, 3)
    own = (255 * colours.clip(0, 1)).astype(np.uint8) if len(colours) == len(points) else None
    return trimesh.Trimesh(vertices, faces, vertex_colors=own, process=False)
