"""true_views: a scan whose cameras are known but for stated errors, for the stages that follow."""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8
from scipy.spatial.transform import Rotation

from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.formats.still_images import save_millimetres
from ingest.scan.scan_types import Registered, Scale, View
from omomo_core.geometry.transforms import inverse
from tests.simulator.scan_camera import FilmErrors, lidar, photographed
from tests.simulator.scan_scene import ScanScene, film, intrinsics

_CORNERS = 150
"""Sparse points that begin in each picture."""
_SPARSE_NOISE = 0.002
"""Metres."""
_SAME = 0.02
"""Metres by which a point may lie beside what a view sees there, and be seen."""


def true_views(
    scene: ScanScene,
    T_world_phone: Float64[np.ndarray, "views 4 4"],
    folder: Path,
    *,
    width: int = 960,
    seed: int = 0,
    shift: float = 0.0,
    turn: float = 0.0,
    depth: bool = False,
    errors: FilmErrors | None = None,
) -> Registered:
    """Pictures of a scene with their poses, and points where the pictures have corners.

    Args:
        scene: what is filmed; its world has z up and the floor at 0.
        T_world_phone: from where.
        folder: gets the pictures and depth maps.
        width: of the pictures, pixels.
        seed: of all errors.
        shift, turn: standard deviation of a camera's place (metres) and direction (rad), each axis.
        depth: with LiDAR's depth maps, 0 where they are not sure.
        errors: of pictures and depth.
    """
    rng, errors = np.random.default_rng(seed), errors or FilmErrors()
    folder.mkdir(parents=True, exist_ok=True)
    views, maps, points, colours = list[View](), list[np.ndarray](), list[np.ndarray](), []
    for k, (drawn, metres) in enumerate(film(scene, T_world_phone, width)):
        picture = photographed(drawn, errors, rng)
        file = folder / f"{k:05d}.png"
        cv2.imwrite(str(file), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        T = T_world_phone[k] @ T_OPENCV_ARKIT_CAMERA
        found, colour = _corners(picture, metres, T)
        points.append(found + rng.normal(0.0, _SPARSE_NOISE, found.shape))
        colours.append(colour)
        maps.append(metres)
        wrong = np.eye(4)
        wrong[:3, :3] = Rotation.from_rotvec(rng.normal(0.0, turn, 3)).as_matrix()
        pose = T @ wrong
        pose[:3, 3] += rng.normal(0.0, shift, 3)
        lidar_file = _saved_depth(metres, errors, rng, folder, k) if depth else None
        size = (width, picture.shape[0])
        views.append(View(file.name, file, size, intrinsics(width), pose, lidar_file))
    places = np.concatenate(points)
    observed = _observed(places, maps, T_world_phone @ T_OPENCV_ARKIT_CAMERA, intrinsics(width))
    return Registered(
        views=tuple(views),
        points=places,
        colours=np.concatenate(colours),
        observed=observed,
        reprojection=0.5,
        scale=Scale(0.0, "given", "the simulation"),
        up="given",
        left_out=(),
        notes=(),
        model=folder,
        images=folder,
    )


def _corners(
    picture: UInt8[np.ndarray, "h w 3"],
    metres: Float32[np.ndarray, "h w"],
    T_world_camera: Float64[np.ndarray, "4 4"],
) -> tuple[Float64[np.ndarray, "points 3"], UInt8[np.ndarray, "points 3"]]:
    """Places (world) and colours of the corners of a picture, none of them at a depth's edge."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    around = np.ones((5, 5), np.uint8)
    even = cv2.dilate(metres, around) - cv2.erode(metres, around) < 0.05 * metres
    mask = ((metres > 0) & even).astype(np.uint8)
    found = cv2.goodFeaturesToTrack(grey, _CORNERS, 0.01, 6, mask=mask)
    u, v = np.asarray(found).reshape(-1, 2).astype(int).T
    fx, fy, cx, cy = intrinsics(picture.shape[1])
    rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(len(u))], axis=1)
    R, eye = T_world_camera[:3, :3], T_world_camera[:3, 3]
    return rays * metres[v, u, None] @ R.T + eye, picture[v, u]


def _observed(
    points: Float64[np.ndarray, "points 3"],
    maps: list[np.ndarray],
    T_world_camera: Float64[np.ndarray, "views 4 4"],
    K: Float64[np.ndarray, "4"],
) -> Int64[np.ndarray, "observations 2"]:
    """Which views show which points."""
    fx, fy, cx, cy = K
    pairs = [np.empty((0, 2), np.int64)]
    for view, (depth, T) in enumerate(zip(maps, T_world_camera, strict=True)):
        x, y, z = (points @ inverse(T)[:3, :3].T + inverse(T)[:3, 3]).T
        z = np.maximum(z, 1e-3)
        at = np.stack([fx * x / z + cx, fy * y / z + cy]).astype(np.float32)[..., None]
        shown = cv2.remap(depth, at[0], at[1], cv2.INTER_NEAREST, borderValue=0)[:, 0]
        seen = np.flatnonzero((shown > 0) & (np.abs(shown - z) < _SAME))
        pairs.append(np.stack([seen, np.full(len(seen), view)], axis=1))
    return np.concatenate(pairs)


def _saved_depth(
    metres: Float32[np.ndarray, "h w"],
    errors: FilmErrors,
    rng: np.random.Generator,
    folder: Path,
    k: int,
) -> Path:
    measured, confidence = lidar(metres, errors, rng)
    file = folder / f"{k:05d}.depth.png"
    save_millimetres(np.where(confidence > 0, measured, 0).astype(np.float32), file)
    return file
