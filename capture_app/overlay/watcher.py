"""Watcher: a camera that filmed, what its pixels mean, and how it moved in a frame that rests."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from capture_app.overlay.film import TimedPictures, open_film, open_video
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.session import CaptureSession
from omomo_core import strict_json
from omomo_core.errors import InputError

_RIGID = 1e-3


@dataclass(frozen=True)
class Watcher:
    """A film and its camera."""

    film: TimedPictures
    T_rest_camera: Float64[np.ndarray, "pictures 4 4"]
    """OpenCV's camera axes. What rests is a tripod itself, or the ARKit world of a phone."""
    intrinsics: Float64[np.ndarray, "pictures 4"]
    """fx, fy, cx, cy in pixels of the film; (0, 0) is the centre of the first."""
    lens: Float64[np.ndarray, " coefficients"]
    """OpenCV's distortion; zeros for none."""


def on_tripod(video: Path, camera: WitnessCamera) -> Watcher:
    """A camera that stood still.

    Raises:
        InputError: "no-video", "video-bounds", or "camera-size".
    """
    film = open_video(video)
    fitting = camera.at(*film.size)
    count = len(film.times)
    numbers = np.array([fitting.fx, fitting.fy, fitting.cx, fitting.cy])
    return Watcher(
        film, np.tile(np.eye(4), (count, 1, 1)), np.tile(numbers, (count, 1)), camera.lens
    )


def by_phone(session: CaptureSession) -> Watcher:
    """A second phone that logged its own poses while it filmed, in a hand or on a tripod.

    Raises:
        InputError: "no-intrinsics", or those of `open_film`.
    """
    film = open_film(session)
    T = PoseStream(session.times, session.T_world_phone).at(film.times) @ T_OPENCV_ARKIT_CAMERA
    return Watcher(film, T, intrinsics_of(session, film), np.zeros(5))


def intrinsics_of(
    session: CaptureSession, film: TimedPictures
) -> Float64[np.ndarray, "pictures 4"]:
    """What the phone logged of its camera, for each picture of its film and in its pixels.

    Raises:
        InputError: "no-intrinsics".
    """
    if session.intrinsics is None or session.image_size is None:
        raise InputError(
            "no-intrinsics",
            f"{session.app} does not log the camera's focal length.",
            where=str(session.source),
            fix="Record with an app that does, such as Stray Scanner; or give the video file with "
            "--camera.",
        )
    scale = film.size[0] / session.image_size[0]
    at = np.stack(
        [np.interp(film.times, session.times, session.intrinsics[:, k]) for k in range(4)], axis=1
    )
    # The middle of a pixel is at a whole number: edges scale, middles do not.
    return np.concatenate([at[:, :2] * scale, (at[:, 2:] + 0.5) * scale - 0.5], axis=1)


def pose_in(path: Path) -> Float64[np.ndarray, "4 4"] | None:
    """T_world_camera that a camera's JSON file gives; None where it gives none.

    Raises:
        InputError: "camera-pose" when it is no rigid transform.
    """
    try:
        table = strict_json.parse(path.read_bytes())
    except ValueError:
        return None  # YAML of a calibrator, which knows no poses
    if not isinstance(table, dict) or "T_world_camera" not in table:
        return None
    try:
        T = np.array(table["T_world_camera"], float).reshape(4, 4)
    except (ValueError, TypeError):
        raise _no_pose(path) from None
    off = float(np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max())
    if not (np.isfinite(T).all() and off < _RIGID and np.linalg.det(T[:3, :3]) > 0):
        raise _no_pose(path)
    return T


def _no_pose(path: Path) -> InputError:
    return InputError(
        "camera-pose",
        "T_world_camera of the camera file is no pose.",
        where=str(path),
        fix="Write four rows of four numbers, metres, in the result's world (z up, floor 0), with the "
        "camera's x right, y down and z ahead.",
    )
