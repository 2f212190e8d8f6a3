"""The floor as a plane in points of depth maps."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64

from ingest.session import CaptureSession
from ingest.trajectory.trajectory_config import DEPTH
from omomo_core.motion import FPS


@dataclass(frozen=True)
class Plane:
    """The points p with normal @ p == offset."""

    normal: Float64[np.ndarray, "3"]
    """Unit vector, on the side of the direction that it was looked for along."""
    offset: float


def fit_plane(
    points: Float64[np.ndarray, "points 3"], along: Float64[np.ndarray, "3"], max_tilt: float
) -> Plane | None:
    """The plane with the most points within 2 cm whose normal is within max_tilt of `along`.

    Random triples of points are tried (RANSAC), the best is fitted to its points. The seed is
    fixed: the same points give the same plane.

    Args:
        points: metres, any world.
        along: unit vector.
        max_tilt: rad.

    Returns:
        None when no such plane holds a tenth of the points.
    """
    if len(points) < DEPTH.fewest_points:
        return None
    triples = points[np.random.default_rng(0).integers(len(points), size=(DEPTH.plane_trials, 3))]
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    good = lengths > 1e-9
    normals = normals[good] / lengths[good, None]
    normals *= np.where(normals @ along < 0, -1.0, 1.0)[:, None]
    near = normals @ along >= np.cos(max_tilt)
    normals, anchors = normals[near], triples[good][near, 0]
    if len(normals) == 0:
        return None
    offsets = np.einsum("ij,ij->i", normals, anchors)
    counts = (np.abs(points @ normals.T - offsets) < DEPTH.plane_thickness).sum(axis=0)
    best = int(np.argmax(counts))
    plane = Plane(normals[best], float(offsets[best]))
    for _ in range(3):
        plane = _refined(points[_on(plane, points)], along)
    enough = _on(plane, points).mean() >= DEPTH.smallest_plane
    return plane if enough and plane.normal @ along >= np.cos(max_tilt) else None


def _on(plane: Plane, points: Float64[np.ndarray, "points 3"]) -> Bool[np.ndarray, " points"]:
    return np.abs(points @ plane.normal - plane.offset) < DEPTH.plane_thickness


def _refined(points: Float64[np.ndarray, "points 3"], along: Float64[np.ndarray, "3"]) -> Plane:
    """Least squares: the normal is the direction in which the points spread least."""
    centre = points.mean(axis=0)
    normal = np.linalg.eigh((points - centre).T @ (points - centre))[1][:, 0]
    normal = normal if normal @ along >= 0 else -normal
    return Plane(normal, float(normal @ centre))


def depth_points(
    session: CaptureSession, usable: Bool[np.ndarray, " frames"]
) -> Float64[np.ndarray, "points 3"] | None:
    """About 8,000 points of eight depth maps spread over the take, metres, session's world.

    Args:
        session: what the phone logged.
        usable: which frames at 30 fps are tracked; maps at other times are left out.

    Returns:
        None when the session has no depth, or no intrinsics to make points of it.
    """
    depth, K, size = session.depth, session.intrinsics, session.image_size
    if depth is None or K is None or size is None:
        return None
    frame = np.round((depth.times - session.times[0]) * FPS).astype(int)
    inside = (frame >= 0) & (frame < len(usable))
    inside[inside] = usable[frame[inside]]
    maps = np.flatnonzero(inside)
    chosen = (
        maps[np.unique(np.linspace(0, len(maps) - 1, DEPTH.maps).astype(int))] if len(maps) else []
    )
    points: list[Float64[np.ndarray, "points 3"]] = [np.empty((0, 3))]
    for index in chosen:
        pose = int(np.argmin(np.abs(session.times - depth.times[index])))
        image = np.rot90(depth.load(depth.files[index]), session.image_turns)
        seen = back_projected(image, K[pose], size)
        T = session.T_world_phone[pose]
        points.append(seen @ T[:3, :3].T + T[:3, 3])
    return np.concatenate(points)


def back_projected(
    depth: Float32[np.ndarray, "height width"],
    intrinsics: Float64[np.ndarray, "4"],
    image_size: tuple[int, int],
) -> Float64[np.ndarray, "points 3"]:
    """Points of a depth map in the phone's frame (x right, y up, z towards the viewer), metres.

    Args:
        depth: metres along the viewing direction, in the orientation of the intrinsics.
        intrinsics: fx, fy, cx, cy in pixels of an image of `image_size`.
        image_size: width and height; the map may be smaller.
    """
    height, width = depth.shape
    stride = max(1, int(np.sqrt(height * width / DEPTH.points_per_map)))
    v, u = np.mgrid[stride // 2 : height : stride, stride // 2 : width : stride]
    d = depth[v, u].astype(np.float64)
    known = (d > DEPTH.nearest) & (d < DEPTH.farthest)
    u, v, d = u[known], v[known], d[known]
    fx, fy, cx, cy = intrinsics
    # Pixel centres stand at whole numbers, so half a pixel is added before scaling.
    x = (u + 0.5) * image_size[0] / width - 0.5 - cx
    y = (v + 0.5) * image_size[1] / height - 0.5 - cy
    return np.stack([x / fx * d, -y / fy * d, -d], axis=1)
