"""read_parts: all meshes of a file that another app made, with their colours and pictures."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float64, Int64, UInt8

from ingest.animated.usd_picture import picture_on
from ingest.axes import T_ZUP_ARKIT
from ingest.mesh import FORMATS, MAX_BYTES, MAX_FACES, decoding, too_large
from ingest.mesh_texture import MOST_PIXELS, BaseColour, picture_of, places_of
from ingest.scan.choices import Up
from ingest.usd import open_stage, pxr, reading_usd, triangles_of
from omomo_core.errors import InputError

_USD_SUFFIXES = (".usdz", ".usd", ".usdc", ".usda")
SUFFIXES = (*FORMATS, *_USD_SUFFIXES)
_Y_UP = (".glb", ".gltf")
STATES_UP = (*_Y_UP, *_USD_SUFFIXES)
"""Kinds of files that say which way is up."""


@dataclass(frozen=True)
class FilePart:
    """A mesh of a file, or the part of one that has its own material."""

    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int64[np.ndarray, "faces 3"]
    colours: UInt8[np.ndarray, "verts 3"] | None
    """Without the picture; None where the file states none."""
    uv: Float64[np.ndarray, "faces 3 2"]
    """Where the corners lie on the picture: (0, 0) is its top left corner."""
    picture: BaseColour | None


@dataclass(frozen=True)
class MeshContents:
    """What a mesh file holds, z up if it says which way is up."""

    parts: Mapping[str, FilePart]
    """By the names of their nodes."""
    metres: float | None
    """A unit of the file, where it states that."""
    up: Up | None
    """The axis of the file that is up, where that is known; it is z here."""


def read_parts(path: Path, up: Up | None = None) -> MeshContents:
    """Read the meshes of a file. glTF and most USD state that y is up, and are turned.

    Args:
        path: GLB, glTF, OBJ, PLY, STL or USD(Z).
        up: the axis of the file that is up, if somebody knows better than the file.

    Raises:
        InputError: "mesh-missing", "mesh-too-large", "mesh-unreadable", "mesh-empty", "mesh-not-finite",
            "usd-...".
    """
    if not path.is_file():
        raise InputError("mesh-missing", "There is no such mesh file.", where=str(path))
    if path.stat().st_size > MAX_BYTES:
        raise too_large(path, f"{path.stat().st_size / 1e6:.0f} MB")
    kind = path.suffix.lower()
    if kind in _USD_SUFFIXES:
        with reading_usd(path):
            file = _stage_parts(path, up)
    else:
        up = up or ("y" if kind in _Y_UP else None)
        turn = T_ZUP_ARKIT if up == "y" else np.eye(4)
        file = MeshContents(_scene_parts(path, turn), None, up)
    found = {name: part for name, part in file.parts.items() if len(part.faces)}
    _check(found, path)
    return MeshContents(found, file.metres, file.up)


def _check(parts: Mapping[str, FilePart], path: Path) -> None:
    if not parts:
        raise InputError(
            "mesh-empty",
            f"{path.name} has no triangles (a point cloud or an empty file).",
            where=str(path),
            fix="Export the object's surface as triangles.",
        )
    for part in parts.values():
        if not 0 <= part.faces.min() <= part.faces.max() < len(part.vertices):
            raise InputError(
                "mesh-unreadable",
                "A triangle names a vertex that is not there.",
                where=str(path),
                fix="Export the file again.",
            )
        if not np.isfinite(part.vertices).all():
            raise InputError(
                "mesh-not-finite",
                f"{path.name} has vertices that are NaN or infinite.",
                where=str(path),
                fix="Export the mesh again.",
            )


def _scene_parts(path: Path, turn: Float64[np.ndarray, "4 4"]) -> dict[str, FilePart]:
    parts: dict[str, FilePart] = {}
    with decoding(path):
        scene = trimesh.load_scene(path, process=False)
        nodes = [(node, *scene.graph[node]) for node in scene.graph.nodes_geometry]
        counts = [len(getattr(scene.geometry[key], "faces", ())) for _, _, key in nodes]
        if sum(counts) > MAX_FACES:  # counted before a scene of many copies is spread out
            raise too_large(path, f"{sum(counts):,} triangles")
        for node, T, key in nodes:
            if isinstance(part := scene.geometry[key], trimesh.Trimesh):
                parts[node] = _scene_part(part, turn @ T)
    return parts


def _scene_part(mesh: trimesh.Trimesh, T: Float64[np.ndarray, "4 4"]) -> FilePart:
    visual: Any = mesh.visual
    picture = picture_of(mesh)
    colours = None
    if visual.kind == "texture" and picture is None:
        colour = np.asarray(visual.material.main_color, np.uint8)[:3]
        colours = np.tile(colour, (len(mesh.vertices), 1))
    elif visual.defined and picture is None:
        colours = np.array(visual.vertex_colors, np.uint8)[:, :3]
    faces = np.array(mesh.faces, np.int64)
    if len(faces) and faces.max() >= len(mesh.vertices):  # told of later, with all other parts
        return FilePart(np.array(mesh.vertices), faces, None, np.full((*faces.shape, 2), 0.5), None)
    vertices = trimesh.transform_points(np.asarray(mesh.vertices, np.float64), T)
    return FilePart(vertices, faces, colours, places_of(mesh), picture)


def _stage_parts(path: Path, up: Up | None) -> MeshContents:
    geom, stage = pxr("UsdGeom"), open_stage(path)
    up = up or ("y" if geom.GetStageUpAxis(stage) == geom.Tokens.y else "z")
    R = T_ZUP_ARKIT[:3, :3] if up == "y" else np.eye(3)
    cache = geom.XformCache()
    prims = stage.Traverse(pxr("Usd").TraverseInstanceProxies())
    parts = {
        str(prim.GetPath()): _stage_part(prim, cache.GetLocalToWorldTransform(prim), R)
        for prim in prims
        if prim.IsA(geom.Mesh)
    }
    return MeshContents(parts, float(geom.GetStageMetersPerUnit(stage)), up)


def _stage_part(prim: Any, placed: Any, R: Float64[np.ndarray, "3 3"]) -> FilePart:
    mesh = pxr("UsdGeom").Mesh(prim)
    points, faces, corners = triangles_of(mesh, 0.0)
    # USD multiplies row vectors from the left.
    T = np.asarray(placed, np.float64)
    vertices = (points @ T[:3, :3] + T[3, :3]) @ R.T
    colours = np.asarray(mesh.GetDisplayColorAttr().Get() or [], np.float64).reshape(-1, 3)
    own = (255 * colours.clip(0, 1)).astype(np.uint8) if len(colours) == len(points) else None
    painted = picture_on(prim, faces, corners)
    if painted is None:
        return FilePart(vertices, faces, own, np.full((*faces.shape, 2), 0.5), None)
    return FilePart(vertices, faces, own, painted[0], BaseColour(painted[1]))


def fits(pictures: list[BaseColour]) -> bool:
    """Whether pictures are few and small enough to be decoded."""
    return sum(one.image.width * one.image.height for one in pictures) <= MOST_PIXELS
