"""CaptureSession: what a phone logged, in one convention, whichever app wrote it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

R_CAMERA_DEVICE = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Maps device axes (portrait: x right, y up, z out of the screen) into ARKit camera axes."""

GRAVITY = 9.80665
"""One g in m/s^2."""


@dataclass(frozen=True)
class ImuLog:
    """Accelerometer and gyroscope on one clock (that of the poses), in device axes."""

    times: Float64[np.ndarray, " samples"]
    """Seconds, never decreasing."""
    accel: Float64[np.ndarray, "samples 3"]
    """m/s^2 as Core Motion signs it: gravity minus the phone's acceleration (down at rest)."""
    gyro: Float64[np.ndarray, "samples 3"]
    """Angular velocity, rad/s, right-hand rule."""


@dataclass(frozen=True)
class DepthLog:
    """Depth maps on the clock of the poses, read one at a time."""

    times: Float64[np.ndarray, " maps"]
    files: tuple[Path, ...]
    load: Callable[[Path], Float32[np.ndarray, "height width"]]
    """Metres along the viewing direction, 0 where unknown or not sure; the session's image, smaller."""


@dataclass(frozen=True)
class CaptureSession:
    """Poses of a phone in the ARKit world: y up, metres, origin where the session started.

    The phone's frame is ARKit's camera: origin in the optical centre of the wide camera, in the
    landscape image x right, y up, z towards the viewer.
    """

    app: str
    """The app that wrote it, e.g. "Stray Scanner"."""
    source: Path
    """The folder or file it was read from."""
    times: Float64[np.ndarray, " frames"]
    """Seconds on the app's clock (since boot, or Unix time), strictly increasing."""
    T_world_phone: Float64[np.ndarray, "frames 4 4"]
    intrinsics: Float64[np.ndarray, "frames 4"] | None = None
    """fx, fy, cx, cy of each pose in pixels of `image_size` (pixel centres at whole numbers)."""
    image_size: tuple[int, int] | None = None
    """Width and height the intrinsics refer to; a smaller video scales them by width'/width."""
    tracking_ok: Bool[np.ndarray, " frames"] | None = None
    """False where the app says ARKit was limited; None when it does not log that (most apps)."""
    video: Path | None = None
    video_times: Float64[np.ndarray, " images"] | None = None
    """Time of each image of the video, in its order; see `ingest.film.pairs_of` for which frame that is."""
    video_numbers: Int64[np.ndarray, " counted"] | None = None
    """Number of each of these images in the video, rising, where the log counts them: it may lack some."""
    imu: ImuLog | None = None
    gravity_aligned: bool = True
    """False where y is not up because the app's world is the first frame's (Record3D)."""
    world_axes: bool = False
    """If not gravity aligned: y or z is up nevertheless, but the log does not say which (TUM)."""
    camera_open: bool = False
    """The log does not state its camera's axes: ARKit's or OpenCV's, still to be decided (TUM)."""
    images: tuple[Path, ...] | None = None
    """Single images where the app writes no video, one for each of `video_times`."""
    image_turns: int = 0
    """Quarter turns counter-clockwise that bring stored images (video, images, depth) into the landscape that
    `intrinsics` and the phone's frame are in."""
    depth: DepthLog | None = None
    notes: tuple[str, ...] = ()
    """Sentences for the user about what was left out or assumed when the log was read."""
