"""Poisson surface of the same stereo points: what the volume is measured against."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import trimesh

from ingest.colmap import pycolmap
from ingest.scan.dense.depth_map import pixel_rays
from ingest.scan.dense.picture import matrix_for
from ingest.scan.types import Region, Registered
from omomo_core.geometry.transforms import inverse

_FLOOR = 0.01
_STRIDE = 2


def poisson(
    registered: Registered, region: Region, maps: Sequence[np.ndarray], depth: int, trim: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of the Poisson surface of what depth maps show in a region (world)."""
    points, normals = _oriented(registered, region, maps)
    with tempfile.TemporaryDirectory() as folder:
        cloud, mesh = Path(folder) / "in.ply", Path(folder) / "out.ply"
        _write(cloud, points, normals)
        pycolmap.poisson_meshing(
            cloud, mesh, pycolmap.PoissonMeshingOptions(depth=depth, trim=trim, color=False)
        )
        found = trimesh.load_mesh(mesh, process=False)
    return np.asarray(found.vertices, np.float64), np.asarray(found.faces, np.int64)


def _oriented(
    registered: Registered, region: Region, maps: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Points in the region above its floor, and normals towards the views, world."""
    points, normals = list[np.ndarray](), list[np.ndarray]()
    T_floor_world = inverse(region.T_world_floor)
    for view, depth in zip(registered.views, maps, strict=True):
        T = view.T_world_camera
        rays = pixel_rays(depth.shape, matrix_for(view, depth.shape[::-1]))
        placed = rays * cv2.medianBlur(depth, 3)[..., None]
        across, down = (np.gradient(placed, axis=axis) for axis in (1, 0))
        normal = -np.cross(across, down)
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        world = placed.astype(float) @ T[:3, :3].T + T[:3, 3]
        standing = world @ T_floor_world[:3, :3].T + T_floor_world[:3, 3]
        low = region.low + np.array([0.0, 0.0, _FLOOR])
        inside = ((standing > low) & (standing < region.high)).all(axis=-1) & (depth > 0)
        smooth = np.linalg.norm(across, axis=-1) < 0.05 * np.maximum(depth, 1e-3)
        kept = (inside & smooth & (length[..., 0] > 0))[::_STRIDE, ::_STRIDE]
        points.append(world[::_STRIDE, ::_STRIDE][kept])
        normals.append(
            (normal / np.maximum(length, 1e-12) @ T[:3, :3].T)[::_STRIDE, ::_STRIDE][kept]
        )
    return np.concatenate(points), np.concatenate(normals)


def _write(path: Path, points: np.ndarray, normals: np.ndarray) -> None:
    fields = ["x", "y", "z", "nx", "ny", "nz"]
    head = "".join(f"property float {name}\n" for name in fields)
    with path.open("wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n".encode())
        file.write(f"{head}end_header\n".encode())
        file.write(np.hstack([points, normals]).astype("<f4").tobytes())
