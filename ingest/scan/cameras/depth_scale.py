"""depth_scale: how long a reconstruction's unit is, by the depth that the phone measured."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.formats.depth_png import load_millimetres
from ingest.scan.types import Frame

_FEWEST = 100
"""Points with a depth."""


def depth_scale(model: pycolmap.Reconstruction, frames: Mapping[str, Frame]) -> float | None:
    """Metres in one unit of a reconstruction: sparse points against depth maps, median.

    Args:
        model: the reconstruction, of any size.
        frames: its pictures by their name.

    Returns:
        None where too few points have a depth.
    """
    ratios = [
        _ratios(model, image, frames[image.name])
        for image in model.images.values()
        if image.has_pose and image.name in frames
    ]
    found = np.concatenate([np.empty(0), *ratios])
    return float(np.median(found)) if len(found) >= _FEWEST else None


def _ratios(
    model: pycolmap.Reconstruction, image: pycolmap.Image, frame: Frame
) -> Float64[np.ndarray, " points"]:
    seen = [point for point in image.points2D if point.has_point3D()]
    if frame.depth is None or not seen:
        return np.empty(0)
    depth = load_millimetres(frame.depth)
    camera = model.cameras[image.camera_id]
    scale = np.array(depth.shape[::-1]) / [camera.width, camera.height]
    # COLMAP counts pixels from the corner of the first one.
    u, v = (np.array([point.xy for point in seen]) * scale).astype(int).T
    measured = depth[v.clip(0, depth.shape[0] - 1), u.clip(0, depth.shape[1] - 1)]
    T = image.cam_from_world().matrix()
    places = np.array([model.points3D[point.point3D_id].xyz for point in seen])
    z = places @ T[2, :3] + T[2, 3]
    known = (measured > 0) & (z > 0)
    return measured[known] / z[known]
