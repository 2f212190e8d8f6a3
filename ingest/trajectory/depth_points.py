"""Points of a few depth maps, in the world of the poses."""

import numpy as np
from jaxtyping import Bool, Float32, Float64

from ingest.session import CaptureSession
from ingest.trajectory.config import DEPTH
from omomo_core.motion import FPS


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
