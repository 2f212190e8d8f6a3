"""ScannedObject: an object's mesh with the cameras and the region that it came from, and its COLMAP model."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.colmap import read_model
from ingest.scan.cameras.metric_scale import Similarity
from ingest.scan.cameras.reconstruction import laid
from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.dense.dense import Mirror
from ingest.scan.scan_types import Frames, Region, Registered, ScanMesh
from omomo_core.geometry.transforms import inverse


@dataclass(frozen=True)
class ScannedObject:
    """The results of the stages of a scan."""

    frames: Frames
    registered: Registered
    region: Region
    cleaned: CleanMesh
    voxel: float
    """Metres: no detail of the surface is finer."""
    method: str
    """Method of the dense stage: "stereo", "depth" or "both"."""
    pieces_cut: float = 0.0
    """Area of what stood in the region and is not the object, as a part of all."""
    mirror: Mirror | None = None
    """The plane of symmetry by which one half of the object shows what the other hides."""
    stretched: float = 1.0
    """What everything was multiplied with in the end; the model in the work folder was not."""


def to_height(found: ScannedObject, height: float | None) -> ScannedObject:
    """Everything scaled so that the object is that high, where nothing else told how large it is.

    Args:
        found: of the stages; returned as it is where its scale came from elsewhere.
        height: of the object, metres.
    """
    if height is None or found.registered.scale.by != "height":
        return found
    factor = height / float(np.ptp(found.cleaned.mesh.vertices[:, 2]))
    voxel = factor * found.voxel
    scale = replace(found.registered.scale, sigma=voxel / height)
    views = tuple(
        replace(view, T_world_camera=_moved(view.T_world_camera, factor))
        for view in found.registered.views
    )
    return replace(
        found,
        registered=replace(
            found.registered, views=views, points=factor * found.registered.points, scale=scale
        ),
        region=Region(
            _moved(found.region.T_world_floor, factor),
            factor * found.region.low,
            factor * found.region.high,
            found.region.notes,
        ),
        cleaned=_larger(found.cleaned, factor),
        voxel=voxel,
        mirror=None if found.mirror is None else found.mirror.larger(factor),
        stretched=factor,
    )


def _larger(cleaned: CleanMesh, factor: float) -> CleanMesh:
    mesh: ScanMesh = replace(cleaned.mesh, vertices=factor * cleaned.mesh.vertices)
    return replace(cleaned, mesh=mesh, T_world_object=_moved(cleaned.T_world_object, factor))


def _moved(T: Float64[np.ndarray, "4 4"], factor: float) -> Float64[np.ndarray, "4 4"]:
    """A pose whose place is farther from the world's origin."""
    moved = T.copy()
    moved[:3, 3] *= factor
    return moved


def write_object_model(
    model: Path, T_world_object: Float64[np.ndarray, "4 4"], stretched: float, folder: Path
) -> None:
    """Write the model as `omocap calibrate scan` reads it without any further transform.

    Args:
        model: of `Registered`.
        T_world_object: where the mesh is in the world, metres.
        stretched: metres of that world in one unit of the model.
        folder: for the model, replaced as a whole.
    """
    turned = read_model(model)
    T = inverse(T_world_object)
    laid(turned, Similarity(stretched, T[:3, :3], T[:3, 3]))
    fresh = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    turned.write(fresh)
    shutil.rmtree(folder, ignore_errors=True)
    fresh.replace(folder)
