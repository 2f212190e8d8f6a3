"""The film of a camera that watched: its pictures, times, pixels and movement."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np
from av.error import FFmpegError
from jaxtyping import Float64, UInt8

from ingest.calibration.board.camera_file import WitnessCamera
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.film import frames_of, size_of, stamps_of
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.session import CaptureSession
from omomo_core import strict_json
from omomo_core.errors import InputError

RGB = UInt8[np.ndarray, "h w 3"]
_MAX_PIXELS = 50_000_000


@dataclass(frozen=True)
class TimedPictures:
    """Pictures as the sensor sees them: what a file says of turning them for viewers is not applied."""

    source: Path
    times: Float64[np.ndarray, " pictures"]
    """Seconds on the film's own clock, increasing."""
    size: tuple[int, int]
    """Width and height."""
    read: Callable[[int, int], Iterator[RGB]]
    """The pictures from one to before another, by their place in `times`."""


def open_video(path: Path) -> TimedPictures:
    """A video file with the times that it stamps.

    Raises:
        InputError: "no-video" or "video-bounds".
    """
    times, size = _stamps(path)
    return TimedPictures(path, times, size, lambda start, stop: _decoded(path, start, stop))


def open_film(session: CaptureSession) -> TimedPictures:
    """Open what a phone filmed while it logged, or its single pictures, on the clock of its poses.

    They are turned into landscape.

    Raises:
        InputError: "no-video" when it filmed nothing, or it cannot be decoded; "video-bounds".
    """
    known = session.times if session.video_times is None else session.video_times
    turns = session.image_turns
    if session.images:
        files = session.images
        height, width = _turned(_image(files[0]), turns).shape[:2]
        return TimedPictures(
            session.source,
            known,
            (width, height),
            lambda start, stop: (_turned(_image(file), turns) for file in files[start:stop]),
        )
    if session.video is None:
        raise InputError(
            "no-video",
            "The session holds no video and no images.",
            where=str(session.source),
            fix="Record with an app that films while it logs, or give the film of another camera "
            "with ‹video›.",
        )
    video = session.video
    stamps, size = _stamps(video)
    # Stray Scanner stamps its first frame before zero, and some tools drop it.
    late = 1 if len(stamps) == len(known) - 1 else 0
    count = min(len(stamps), len(known) - late)

    def read(start: int, stop: int) -> Generator[RGB]:
        for picture in _decoded(video, start, stop):
            yield _turned(picture, turns)

    wide = size if turns % 2 == 0 else (size[1], size[0])
    return TimedPictures(video, known[late : late + count], wide, read)


def _stamps(path: Path) -> tuple[Float64[np.ndarray, " pictures"], tuple[int, int]]:
    """Second of each picture in the order of showing, and their size; nothing is decoded."""
    try:
        stamps = stamps_of(path)
        with av.open(str(path)) as container:
            size = size_of(container)
            tick = float(container.streams.video[0].time_base or 0)
    except (FFmpegError, IndexError, OSError) as problem:
        raise _unreadable(path, problem) from None
    if not stamps:
        raise _unreadable(path, "it holds no picture")
    if size[0] * size[1] > _MAX_PIXELS:
        raise InputError(
            "video-bounds",
            f"The pictures are larger than {_MAX_PIXELS // 10**6} megapixels.",
            where=str(path),
            fix="Give a smaller video.",
        )
    return np.array(stamps) * tick, size


def _decoded(path: Path, start: int, stop: int) -> Generator[RGB]:
    """The pictures from one to before another, by their places."""
    missing = stop - start
    try:
        for _, frame in frames_of(path, range(start, stop)):
            missing -= 1
            yield frame.to_ndarray(format="rgb24")
    except (FFmpegError, IndexError, OSError) as problem:
        raise _unreadable(path, problem) from None
    if missing:
        raise _unreadable(path, f"{missing} of its pictures are damaged")


def _image(path: Path) -> RGB:
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if picture is None:
        raise InputError("image-damaged", f"{path.name} is no picture.", where=str(path))
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)


def _turned(picture: RGB, turns: int) -> UInt8[np.ndarray, "height width 3"]:
    return np.ascontiguousarray(np.rot90(picture, turns))


def _unreadable(path: Path, why: object) -> InputError:
    return InputError(
        "no-video",
        f"No video can be read: {why}.",
        where=str(path),
        fix="Give a video file such as MP4 or MOV that a player shows to its end, or a session.",
    )


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
    """Return the phone's intrinsics for each picture of its film, in its pixels.

    Raises:
        InputError: "no-intrinsics".
    """
    if session.intrinsics is None or session.image_size is None:
        raise InputError(
            "no-intrinsics",
            f"{session.app} does not log the camera's focal length.",
            where=str(session.source),
            fix="Record with an app that does, such as Stray Scanner; or give the video file with "
            "‹camera›.",
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
