"""by_scan: where a camera that watched stood, by what it sees of a scan of the object and its room."""

import cv2
import numpy as np
from jaxtyping import Float64

from capture_app.commands.overlay import OverlayRequest
from capture_app.overlay.placing import agreed
from capture_app.overlay.watcher import Watcher
from capture_app.progress import Progress
from ingest.calibration.pose_file import load_similarity
from ingest.calibration.scan_landmarks import read_landmarks
from ingest.calibration.scan_mount import PhonePicture, localise
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMotion

_PICTURES = 5


def by_scan(
    request: OverlayRequest, moved: ObjectMotion, watcher: Watcher, progress: Progress
) -> Float64[np.ndarray, "4 4"]:
    """T_world_rest: from the frame in which the watcher moves into the world of the motion.

    Args:
        request: with a scan, whose surroundings count as much as the object: it may be elsewhere in
            the film.
        moved: the object.
        watcher: a few of its pictures are found again in the scan.
        progress: called with the stage "localise".

    Raises:
        InputError: those of `read_landmarks`; of `localise` when no picture is found again.
    """
    assert request.scan is not None
    T_world_scanned = moved.T_world_object[_frame(request.scanned_at, moved)]
    to_object = request.model_to_object
    T, scale = (np.eye(4), 1.0) if to_object is None else load_similarity(to_object)
    T[:3, :3] *= scale
    landmarks = read_landmarks(request.scan, request.scan_images, None, T)
    count = len(watcher.film.times)
    chosen = np.unique(np.linspace(0, count - 1, _PICTURES).round().astype(int))
    rest: list[np.ndarray] = []
    problem: InputError | None = None
    for n, k in enumerate(chosen):
        progress("localise", n / len(chosen))
        try:
            seen = localise(_view(watcher, int(k)), landmarks)
        except InputError as error:
            problem = problem or error
            continue
        T_scanned_camera = inverse(T_OPENCV_ARKIT_CAMERA @ seen.T_phone_object)
        rest.append(T_world_scanned @ T_scanned_camera @ inverse(watcher.T_rest_camera[k]))
    progress("localise", 1.0)
    if problem is not None and not rest:
        raise problem
    return agreed(np.array(rest))


def _frame(seconds: float, moved: ObjectMotion) -> int:
    frame = round(seconds * FPS)
    if not 0 <= frame < len(moved.valid):
        raise InputError(
            "scan-time",
            f"The motion has no second {seconds:g}: it lasts {len(moved.valid) / FPS:.2f} s.",
            where="--scanned-at",
            fix="Give a second of the motion at which the object stood where it was scanned.",
        )
    return frame


def _view(watcher: Watcher, k: int) -> PhonePicture:
    """One of its pictures without the lens' distortion."""
    picture = next(watcher.film.read(k, k + 1))
    fx, fy, cx, cy = watcher.intrinsics[k]
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    if watcher.lens.any():
        grey = cv2.undistort(grey, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), watcher.lens)
    name = f"{watcher.film.source}, {watcher.film.times[k]:.2f} s"
    return PhonePicture(name, np.asarray(grey, np.uint8), watcher.intrinsics[k])
