"""USD files opened safely, and their meshes as triangles. Needs usd-core."""

import re
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64, Int64

from ingest.mesh_files.file_parts import decoding
from ingest.mesh_files.polygons import triangulated
from omomo_core.errors import DamageError, InputError


def pxr(module: str) -> Any:
    """A module of usd-core.

    Raises:
        InputError: "usd-missing".
    """
    try:
        return import_module(f"pxr.{module}")
    except ImportError:
        raise InputError(
            "usd-missing",
            "Reading USD needs a package that is not installed: usd-core.",
            fix="Run pip install usd-core, or export as GLB.",
        ) from None


def reading_usd(path: Path) -> AbstractContextManager[None]:
    """Turn whatever USD raises on a damaged file into one error.

    Raises:
        InputError: "usd-unreadable", or what the block raises itself.
    """
    return decoding(path, "usd-unreadable")


def _check_conventions(stage: Any, path: Path) -> None:
    """Up is y or z, and a unit is so many metres; a hand-written stage may state anything."""
    up = str(stage.GetMetadata("upAxis") or "Y")
    unit = float(pxr("UsdGeom").GetStageMetersPerUnit(stage))
    if up not in ("Y", "Z") or not 0 < unit < float("inf"):
        raise InputError(
            "usd-convention",
            f"The stage says that {up} is up and that a unit is {unit:g} m.",
            where=str(path),
            fix="Set upAxis to Y or Z and metersPerUnit to a positive number, e.g. 0.01.",
        )


def _names_a_file(error: Any) -> bool:
    """Whether a part of a stage is missing because its file is."""
    kinds = pxr("Pcp")
    return error.errorType in (
        kinds.ErrorType_InvalidAssetPath,
        kinds.ErrorType_InvalidSublayerPath,
    )


def open_stage(path: Path) -> Any:
    """The stage of one file that takes nothing from others.

    Raises:
        InputError: "usd-missing", "usd-unreadable", "usd-external", or "usd-convention" for an up axis
            or a unit that there is none of.
    """
    usd = pxr("Usd")
    with reading_usd(path):
        stage = usd.Stage.Open(str(path))
        layers = [str(layer.realPath) for layer in stage.GetUsedLayers() if layer.realPath]
        _check_conventions(stage, path)
        broken = [error for error in stage.GetCompositionErrors() if _names_a_file(error)]
    if broken:
        named = re.search(r"@([^@]*)@", str(broken[0]))
        missing = f": {Path(named[1]).name}" if named else ""
        raise InputError(
            "usd-external",
            f"{path.name} takes things from another file that is not there{missing}.",
            where=str(path),
            fix="Put that file where this one names it, and flatten both into one (usdcat --flatten).",
        )
    whole = str(path.resolve())
    others = [layer for layer in layers if not layer.startswith(whole)]
    if others:
        raise InputError(
            "usd-external",
            f"{path.name} takes things from other files, e.g. {Path(others[0]).name}.",
            where=str(path),
            fix="Flatten it into one file (usdcat --flatten).",
        )
    return stage


@dataclass(frozen=True)
class UsdTriangles:
    """A mesh of USD in its own frame, its polygons as triangles."""

    points: Float64[np.ndarray, "points 3"]
    faces: Int64[np.ndarray, "triangles 3"]
    """Which points are the triangles' corners."""
    corners: Int64[np.ndarray, "triangles 3"]
    """Which of all the polygons' corners these are, in the order of the file."""
    counts: Int64[np.ndarray, " polygons"]


def triangles_of(mesh: Any, code: float) -> UsdTriangles:
    """Return the triangles of a UsdGeom.Mesh at a time code, without its holes.

    Raises:
        ValueError: the lists of the mesh do not fit together.
    """
    points = np.array(mesh.GetPointsAttr().Get(code) or [], np.float64).reshape(-1, 3)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(code) or [], np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(code) or [], np.int64)
    if (counts < 0).any() or counts.sum() != len(corners):
        raise DamageError("a mesh has more corners, or fewer, than its polygons")
    used = triangulated(points, corners, counts)
    holes = np.array(mesh.GetHoleIndicesAttr().Get(code) or [], np.int64)
    if len(holes):
        polygon = np.searchsorted(np.cumsum(counts), used[:, 0], side="right")
        used = used[~np.isin(polygon, holes)]
    if mesh.GetOrientationAttr().Get() == pxr("UsdGeom").Tokens.leftHanded:
        used = used[:, ::-1]
    return UsdTriangles(points, corners[used].reshape(-1, 3), used, counts)
