"""Views of a reconstruction: its pictures as pinholes, the lens undone where there is one."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.scan.cameras.reconstruction import poses_of
from ingest.scan.types import Frame, View

_STRAIGHT = 0.2
"""Pixels that a lens may bend a picture by and still count as a pinhole."""
_QUALITY = 97


def views_of(
    model: pycolmap.Reconstruction,
    names: Sequence[str],
    frames: Mapping[str, Frame],
    straightened: Path,
) -> tuple[View, ...]:
    """The registered pictures as pinholes, in the model's world.

    Args:
        model: the reconstruction.
        names: of the pictures wanted.
        frames: the pictures by their name.
        straightened: folder for those whose lens bends; what is there already is not made again.
    """
    cameras = {image.name: model.cameras[image.camera_id] for image in model.images.values()}
    T = poses_of(model, names)
    return tuple(_view(frames[n], cameras[n], T[k], straightened) for k, n in enumerate(names))


def _view(
    frame: Frame, camera: pycolmap.Camera, T: Float64[np.ndarray, "4 4"], straightened: Path
) -> View:
    size = camera.width, camera.height
    fx, fy = camera.focal_length_x, camera.focal_length_y
    # COLMAP counts pixels from the corner of the first one.
    K = np.array([fx, fy, camera.principal_point_x - 0.5, camera.principal_point_y - 0.5])
    file = frame.file
    if not _is_straight(camera, K):
        file = straightened / frame.name
        if not file.is_file():
            _straighten(frame.file, camera, K, file)
    return View(frame.name, file, size, K, T, frame.depth)


def _is_straight(camera: pycolmap.Camera, K: Float64[np.ndarray, "4"]) -> bool:
    grid = _pixels(camera, 9)
    return float(np.abs(_bent(camera, K, grid) - grid).max()) < _STRAIGHT


def _pixels(camera: pycolmap.Camera, steps: int) -> Float64[np.ndarray, "pixels 2"]:
    x = np.linspace(0, camera.width - 1, steps)
    y = np.linspace(0, camera.height - 1, steps)
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _bent(
    camera: pycolmap.Camera, K: Float64[np.ndarray, "4"], pixels: Float64[np.ndarray, "pixels 2"]
) -> Float64[np.ndarray, "pixels 2"]:
    """Where the camera has what a pinhole has at these pixels."""
    flat = (pixels - K[2:]) / K[:2]
    rays = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
    return np.asarray(camera.img_from_cam(rays), np.float64) - 0.5


def _straighten(
    source: Path, camera: pycolmap.Camera, K: Float64[np.ndarray, "4"], target: Path
) -> None:
    picture = cv2.imread(str(source), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    assert picture is not None
    height, width = camera.height, camera.width
    x, y = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    where = _bent(camera, K, np.stack([x, y], axis=-1).reshape(-1, 2))
    # A picture that was made smaller since: its pixels are those of the camera, scaled.
    scale = np.array([picture.shape[1] / width, picture.shape[0] / height])
    at = ((where + 0.5) * scale - 0.5).reshape(height, width, 2).astype(np.float32)
    straight = cv2.remap(picture, at[..., 0], at[..., 1], cv2.INTER_LINEAR)
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{target.stem}.part.jpg")
    cv2.imwrite(str(temporary), straight, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    temporary.replace(target)
