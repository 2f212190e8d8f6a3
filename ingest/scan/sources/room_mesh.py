"""room_depth: depth maps of a scan's views out of the room's mesh that the phone's app made itself.

3D Scanner App, Polycam and Scaniverse export what ARKit meshed in the world of the poses. Seen from the
logged poses it is depth that every picture can have, also where the app saved none.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float32, Float64

from ingest.scan.dense.depth_map import DepthMap, DepthMaps, pixel_rays
from ingest.scan.dense.depths import sparse_ratios
from ingest.scan.dense.picture import matrix_for
from ingest.scan.sources.mesh_parts import SUFFIXES
from ingest.scan.types import Frame, Registered
from omomo_core.errors import InputError

APP = "app"
"""Stands for the mesh that lies in the session's folder."""
_WIDTH = 256
"""Pixels of the depth maps, as many as LiDAR has."""
_FEWEST = 50
"""Sparse points that tell whether the mesh is in the world of the poses."""
_LIKE, _MOST = 0.15, 0.5
"""Part of the depth by which at most half of the points may be off."""


def room_file(said: str, session: Path) -> Path:
    """The file of the room's mesh: as it is given, or the largest in the session for "app".

    Raises:
        InputError: "scan-mesh-missing".
    """
    folder = session if session.is_dir() else session.parent
    if said != APP:
        found = [Path(said)] if Path(said).is_file() else []
    else:
        files = [*folder.glob("*"), *folder.glob("*/*")]
        found = [file for file in files if file.suffix.lower() in SUFFIXES and file.is_file()]
    if not found:
        raise InputError(
            "scan-mesh-missing",
            "There is no mesh of the room.",
            where=str(folder) if said == APP else said,
            fix="Export the scan's mesh (GLB, OBJ, PLY or USDZ) from the phone's app into the session's "
            "folder, or give the file.",
        )
    return max(found, key=lambda file: file.stat().st_size)


def room_depth(
    room: trimesh.Trimesh, registered: Registered, frames: Sequence[Frame], where: str
) -> DepthMaps:
    """Depth of the room's mesh in each view, seen from where the phone logged it; 0 where none is.

    Args:
        room: in the phone's world, z up, metres.
        registered: the views.
        frames: the pictures that were picked, with their logged poses.
        where: the mesh came from, for messages.

    Raises:
        InputError: "scan-mesh-elsewhere" where it is not in the world of the poses.
    """
    logged = {frame.name: frame.T_world_camera for frame in frames}
    maps: list[DepthMap] = []
    for view in registered.views:
        width, height = view.size
        size = (_WIDTH, round(_WIDTH * height / width))
        T = logged.get(view.name)
        known = T is not None and np.isfinite(T).all()
        empty = np.zeros(size[::-1], np.float32)
        maps.append(
            _seen(room, T, matrix_for(view, size), size) if known and T is not None else empty
        )
    ratios = [sparse_ratios(registered, k, depth) for k, depth in enumerate(maps)]
    found = np.concatenate([np.empty(0, np.float32), *ratios])
    off = np.abs(found / np.median(found) - 1) if len(found) else found
    if len(found) < _FEWEST or (off > _LIKE).mean() > _MOST:
        raise InputError(
            "scan-mesh-elsewhere",
            "The mesh of the room does not lie in the world of the phone's poses.",
            where=where,
            fix="Give the mesh that the same app exported of the same recording, unturned.",
        )
    return maps


def _seen(
    room: trimesh.Trimesh,
    T_world_camera: Float64[np.ndarray, "4 4"],
    matrix: Float64[np.ndarray, "3 3"],
    size: tuple[int, int],
) -> Float32[np.ndarray, "h w"]:
    """Depth of the nearest surface in each pixel, metres; 0 where there is none."""
    rays = pixel_rays(size[::-1], matrix).reshape(-1, 3).astype(np.float64)
    directions = rays @ T_world_camera[:3, :3].T
    eyes = np.broadcast_to(T_world_camera[:3, 3], directions.shape)
    places, number, _ = room.ray.intersects_location(eyes, directions, multiple_hits=False)
    depth = np.zeros(len(rays), np.float32)
    depth[number] = (places - T_world_camera[:3, 3]) @ T_world_camera[:3, 2]
    return depth.reshape(size[::-1])
