"""The film of a camera that watched: its pictures, times, pixels and movement."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from ingest.calibration.board.camera_file import WitnessCamera
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.film import Film, Turning, film_at, frames_of
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.session import CaptureSession
from ingest.session_images import (
    damaged_images,
    film_and_pairs,
    image_times,
    left_out,
    pictures_damaged,
)
from omomo_core import strict_json
from omomo_core.errors import InputError

RGB = UInt8[np.ndarray, "h w 3"]
_MAX_PIXELS = 50_000_000


@dataclass(frozen=True)
class TimedPictures:
    """Pictures as the camera's numbers have them."""

    source: Path
    times: Float64[np.ndarray, " pictures"]
    """Seconds on the film's own clock, increasing."""
    size: tuple[int, int]
    """Width and height."""
    read: Callable[[int, int], Iterator[tuple[int, RGB]]]
    """The pictures from one to before another with their places in `times`; damaged ones are left out."""
    shown: Turning | None = None
    """How they are to be shown, where the film says it."""
    places: tuple[int, ...] = ()
    """Place in the film of each picture that a phone filmed while it logged."""
    lost: int = 0
    """Images of the phone's log that the film does not hold."""
    files: tuple[Path, ...] = ()
    """The file of each picture, where it has one of its own."""

    def name(self, place: int) -> str:
        """What a message calls a picture."""
        return self.files[place].name if self.files else f"that at {self.times[place]:.2f} s"


def open_video(path: Path, turns: int = 0) -> TimedPictures:
    """A video file with the times that it stamps.

    Args:
        path: of the video.
        turns: quarter turns counter-clockwise of its pictures: those of `Film.turns_for`, or 0.

    Raises:
        InputError: "no-video" or "video-bounds".
    """
    film = _bounded(film_at(path))
    states = film.turning != Turning()
    left = Turning(0, film.turning.mirrored) if turns else film.turning

    def read(start: int, stop: int) -> Generator[tuple[int, RGB]]:
        for place, frame in frames_of(path, range(start, stop)):
            yield place, _turned(frame.to_ndarray(format="rgb24"), turns)

    return TimedPictures(path, film.times, _wide(film.size, turns), read, left if states else None)


def open_film(session: CaptureSession) -> TimedPictures:
    """Open what a phone filmed while it logged, or its single pictures, on the clock of its poses.

    They are turned into landscape.

    Raises:
        InputError: "no-video" when it filmed nothing, or it cannot be decoded; "video-bounds";
            "pictures-damaged" when a considerable part cannot be read; those of `film_and_pairs`.
    """
    known = image_times(session)
    turns = session.image_turns
    if session.images:
        return _stills(session, session.images, known)
    if session.video is None:
        raise InputError(
            "no-video",
            "The session holds no video and no images.",
            where=str(session.source),
            fix="Record with an app that films while it logs, or give the film of another camera "
            "with ‹video›.",
        )
    film, pairs = film_and_pairs(session, session.video)
    _bounded(film)
    places = pairs.frames.tolist()

    place_of = {frame: place for place, frame in enumerate(places)}

    def read(start: int, stop: int) -> Generator[tuple[int, RGB]]:
        for k, frame in frames_of(film.path, places[start:stop]):
            yield place_of[k], _turned(frame.to_ndarray(format="rgb24"), turns)

    size = _wide(film.size, turns)
    return TimedPictures(
        film.path, known[pairs.images], size, read, places=tuple(places), lost=pairs.lost
    )


def _bounded(film: Film) -> Film:
    if film.size[0] * film.size[1] > _MAX_PIXELS:
        raise InputError(
            "video-bounds",
            f"The pictures are larger than {_MAX_PIXELS // 10**6} megapixels.",
            where=str(film.path),
            fix="Give a smaller video.",
        )
    return film


def _wide(size: tuple[int, int], turns: int) -> tuple[int, int]:
    return size if turns % 2 == 0 else (size[1], size[0])


def _stills(
    session: CaptureSession, files: tuple[Path, ...], times: Float64[np.ndarray, " pictures"]
) -> TimedPictures:
    damaged = damaged_images(files)
    left_out(damaged, len(files), session.source)
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION

    def read(start: int, stop: int) -> Generator[tuple[int, RGB]]:
        for place, file in enumerate(files[start:stop], start):
            picture = None if file.name in damaged else cv2.imread(str(file), flags)
            if picture is not None:
                rgb = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)
                yield place, _turned(rgb, session.image_turns)

    first = next(read(0, len(files)), None)
    if first is None:
        raise pictures_damaged([file.name for file in files], len(files), session.source)
    height, width = first[1].shape[:2]
    return TimedPictures(session.source, times, (width, height), read, files=files)


def _turned(picture: RGB, turns: int) -> UInt8[np.ndarray, "height width 3"]:
    return np.ascontiguousarray(np.rot90(picture, turns))


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


def on_tripod(
    video: Path, camera: WitnessCamera, T_world_camera: Float64[np.ndarray, "4 4"] | None = None
) -> Watcher:
    """A camera that stood still.

    A film may say that it is to be shown turned. The camera then is one for the stored pictures or one for
    those that players show, as the size says that it was calibrated for; of a half turn the place tells in
    which of them up is at the top.

    Args:
        video: its film.
        camera: its intrinsics.
        T_world_camera: OpenCV's axes, in a world that is z up, where known.

    Raises:
        InputError: "no-video", "video-bounds", or "camera-size".
    """
    stored = film_at(video)
    turns = stored.turns_for(camera.size)
    if stored.turning.turns == 2 and T_world_camera is not None and T_world_camera[2, 1] < 0:
        turns = 2
    film = open_video(video, turns)
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
