"""read_scan_mesh: a mesh that another app made of the object, in metres, z up, with its colours."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float64, UInt8
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ingest.axes import T_ZUP_ARKIT
from ingest.mesh import FORMATS, MAX_BYTES, MAX_EXTENT, MAX_FACES, MIN_EXTENT, decoding, too_large
from ingest.report.check import Check
from ingest.scan.choices import Unit
from ingest.scan.types import ScanMesh
from ingest.usd import open_stage, pxr, reading_usd, triangles_of
from omomo_core.errors import InputError

_USD_SUFFIXES = (".usdz", ".usd", ".usdc", ".usda")
SUFFIXES = (*FORMATS, *_USD_SUFFIXES)
_Y_UP = (".glb", ".gltf")
_APART = 0.02
"""Gap between the boxes of two parts, in sizes of the whole, that makes them two objects."""
_CRUMB = 0.02
"""Part of the largest object's faces that another one has at least."""

METRES: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
NAMES: dict[Unit, str] = {
    "m": "metres", "cm": "centimetres", "mm": "millimetres", "in": "inches", "ft": "feet"
}  # fmt: skip
_PLAUSIBLE = (0.1, 2.5)
"""Metres of the largest side of what people carry, drag or sweep with."""
_USUAL = 0.8
"""Metres; of two plausible units, that which makes the largest side more like this is taken."""


def read_scan_mesh(
    path: Path, *, name: str | None = None, unit: Unit | None = None, height: float | None = None
) -> ScanMesh:
    """Read a ready mesh.

    glTF and most USD are y up and turned; other formats state no up axis and stay as they are.

    Args:
        path: GLB, glTF, OBJ, PLY, STL or USD(Z).
        name: of the object in the file, where there are several.
        unit: of the file, where it is known; otherwise what the file says, or guessed.
        height: true extent along z, metres; goes before any unit.

    Raises:
        InputError: "mesh-missing", "mesh-format", "mesh-too-large", "mesh-unreadable", "mesh-empty",
            "mesh-not-finite", "mesh-objects", "mesh-object-unknown", "mesh-units", "usd-...".
    """
    _check_file(path)
    parts, stated = (
        _usd_parts(path) if path.suffix.lower() in _USD_SUFFIXES else (_parts(path), None)
    )
    parts = {key: part for key, part in parts.items() if len(part.faces)}
    _check_parts(parts, path)
    chosen = _chosen(parts, name, path)
    vertices = np.concatenate([np.asarray(part.vertices, np.float64) for part in chosen])
    first = np.cumsum([0, *(len(part.vertices) for part in chosen[:-1])])
    faces = np.concatenate(
        [np.asarray(p.faces, np.int64) + at for p, at in zip(chosen, first, strict=True)]
    )
    metres, notes = _metres(np.ptp(vertices, axis=0), unit, stated, height, path)
    return ScanMesh(vertices * metres, faces, _colours(chosen), path.stem, notes)


def _check_file(path: Path) -> None:
    if not path.is_file():
        raise InputError("mesh-missing", "There is no such mesh file.", where=str(path))
    if path.stat().st_size > MAX_BYTES:
        raise too_large(path, f"{path.stat().st_size / 1e6:.0f} MB")


def _parts(path: Path) -> dict[str, trimesh.Trimesh]:
    """The meshes of a file by the names of their nodes, in the file's world turned z up."""
    parts: dict[str, trimesh.Trimesh] = {}
    with decoding(path):
        scene = trimesh.load_scene(path, process=False)
        nodes = [(node, *scene.graph[node]) for node in scene.graph.nodes_geometry]
        counts = [len(getattr(scene.geometry[key], "faces", ())) for _, _, key in nodes]
        if sum(counts) > MAX_FACES:  # counted before a scene of many copies is spread out
            raise too_large(path, f"{sum(counts):,} triangles")
        for node, T, key in nodes:
            if isinstance(part := scene.geometry[key], trimesh.Trimesh):
                parts[node] = part.copy().apply_transform(T)
    if path.suffix.lower() in _Y_UP:
        for part in parts.values():
            part.apply_transform(T_ZUP_ARKIT)
    return parts


def _check_parts(parts: Mapping[str, trimesh.Trimesh], path: Path) -> None:
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


def _chosen(
    parts: Mapping[str, trimesh.Trimesh], name: str | None, path: Path
) -> list[trimesh.Trimesh]:
    """The parts of the one object; meshes that touch are one object in several pieces."""
    names = list(parts)
    if name is not None:
        picked = [key for key in names if name in (key, key.rsplit("/", 1)[-1])]
        picked = picked or [key for key in names if f"/{name}/" in key]
        if not picked:
            raise InputError(
                "mesh-object-unknown",
                f"{path.name} holds nothing called {name!r}.",
                where=str(path),
                fix=f"Give one of {', '.join(names[:12])}.",
            )
        return [parts[key] for key in picked]
    label = _together(np.array([parts[key].bounds for key in names]))
    faces = np.bincount(label, [len(parts[key].faces) for key in names])
    objects = np.flatnonzero(faces >= _CRUMB * faces.max())
    if len(objects) > 1:
        size = np.array([np.linalg.norm(parts[key].extents) for key in names])
        largest = [names[int(np.where(label == one, size, 0).argmax())] for one in objects]
        raise InputError(
            "mesh-objects",
            f"{path.name} holds {len(objects)} objects that stand apart: {', '.join(largest[:8])}.",
            where=str(path),
            fix="Say which one is meant (--object-name), or export it alone.",
        )
    return [parts[key] for key, one in zip(names, label, strict=True) if one == objects[0]]


def _together(bounds: Float64[np.ndarray, "parts 2 3"]) -> np.ndarray:
    """Parts whose bounding boxes touch get the same number."""
    low, high = bounds[:, 0], bounds[:, 1]
    reach = _APART * np.linalg.norm(high.max(axis=0) - low.min(axis=0))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=-1)
    return connected_components(coo_array(gap <= reach), directed=False)[1]


def _metres(
    extents: Float64[np.ndarray, "3"],
    unit: Unit | None,
    stated: float | None,
    height: float | None,
    path: Path,
) -> tuple[float, tuple[Check, ...]]:
    """Metres per unit of the file."""
    if height is not None:
        if not 0 < height < 10 or extents[2] <= 0:
            raise InputError(
                "mesh-units",
                f"An object is not {height:g} m high.",
                where=str(path),
                fix="Give its height in metres.",
            )
        return height / float(extents[2]), ()
    if unit is not None:
        return METRES[unit], ()
    metres, notes = _guess_unit(extents * (stated or 1.0), str(path))
    return metres * (stated or 1.0), notes


def _colours(parts: list[trimesh.Trimesh]) -> UInt8[np.ndarray, "vertices 3"] | None:
    """Colours of the vertices, sampled from the texture where they have one."""
    visuals: list[Any] = [part.visual for part in parts]
    if not any(visual.defined for visual in visuals):
        return None
    own = [v.to_color() if v.kind == "texture" else v for v in visuals]
    return np.concatenate([np.asarray(v.vertex_colors, np.uint8)[:, :3] for v in own])


def _guess_unit(extents: Float64[np.ndarray, "3"], where: str) -> tuple[float, tuple[Check, ...]]:
    """Metres per unit of a mesh that states none, and what to tell about it.

    Args:
        extents: sides of its bounding box in its own unit.
        where: its file, for messages.

    Raises:
        InputError: "mesh-units" when no unit makes it a thing that a person moves.
    """
    largest = float(extents.max())
    if MIN_EXTENT <= largest <= MAX_EXTENT:
        return 1.0, ()
    sides = " x ".join(f"{side:.4g}" for side in extents)
    likely: list[Unit] = [
        unit
        for unit in ("cm", "mm", "in")
        if _PLAUSIBLE[0] <= largest * METRES[unit] <= _PLAUSIBLE[1]
    ]
    likely.sort(key=lambda unit: abs(np.log(largest * METRES[unit] / _USUAL)))
    if not likely:
        raise InputError(
            "mesh-units",
            f"The mesh measures {sides}; in no unit is that a thing that a person moves.",
            where=where,
            fix="Say its unit (--units), or the true height of the object (--height).",
        )
    best, others = likely[0], likely[1:]
    alternatives = "; ".join(
        f"in {NAMES[u]} it would be {largest * METRES[u]:.2f} m" for u in others
    )
    message = (
        f"The mesh measures {sides} and does not say in what; taken for {NAMES[best]}, so that its "
        f"largest side is {largest * METRES[best]:.2f} m"
    )
    message += f" ({alternatives})." if alternatives else "."
    fix = "Measure the object; if that is wrong, say its unit (--units) or its height (--height)."
    return METRES[best], (Check("units", "warn", message, None, fix),)


def _usd_parts(path: Path) -> tuple[dict[str, trimesh.Trimesh], float]:
    """The meshes of a stage by the names of their prims, in the world turned z up, and its unit.

    Colours are those of the vertices (primvars:displayColor); textures are not read.

    Returns:
        Meshes in the stage's unit, and that in metres.

    Raises:
        InputError: of `open_stage`.
    """
    with reading_usd(path):
        return _stage_parts(path)


def _stage_parts(path: Path) -> tuple[dict[str, trimesh.Trimesh], float]:
    geom, stage = pxr("UsdGeom"), open_stage(path)
    up_y = geom.GetStageUpAxis(stage) == geom.Tokens.y
    R = T_ZUP_ARKIT[:3, :3] if up_y else np.eye(3)
    cache = geom.XformCache()
    prims = stage.Traverse(pxr("Usd").TraverseInstanceProxies())
    parts = {
        str(prim.GetPath()): _stage_part(geom.Mesh(prim), cache.GetLocalToWorldTransform(prim), R)
        for prim in prims
        if prim.IsA(geom.Mesh)
    }
    return parts, float(geom.GetStageMetersPerUnit(stage))


def _stage_part(mesh: Any, placed: Any, R: np.ndarray) -> trimesh.Trimesh:
    points, faces, _ = triangles_of(mesh, 0.0)
    # USD multiplies row vectors from the left.
    T = np.asarray(placed, np.float64)
    vertices = (points @ T[:3, :3] + T[3, :3]) @ R.T
    colours = np.asarray(mesh.GetDisplayColorAttr().Get() or [], np.float64).reshape(-1, 3)
    own = (255 * colours.clip(0, 1)).astype(np.uint8) if len(colours) == len(points) else None
    return trimesh.Trimesh(vertices, faces, vertex_colors=own, process=False)
