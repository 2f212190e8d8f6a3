"""The track of a board over a film, a folder of pictures or a session."""

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float64, Int

from ingest.calibration.board.board_detect import Corners, Detector, Grey, fits, not_found
from ingest.calibration.board.board_lens import calibrate_camera
from ingest.calibration.board.board_poses import BoardPoses, board_poses
from ingest.calibration.board.board_spec import MIN_CORNERS, Board, Checkerboard
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.film import film_at, frames_of
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.session import CaptureSession
from ingest.session_images import film_and_pairs, image_times, picture_size
from omomo_core.errors import InputError

MAX_PIXELS = 50_000_000
MAX_PICTURES = 20_000
_SUFFIXES = (".png", ".jpg", ".jpeg")
TIMES = "times.csv"


class Picture(NamedTuple):
    """One picture."""

    time: float
    """Seconds, on the clock of its source."""
    grey: Grey


Progress = Callable[[str, float], None]


class _Pace:
    """Lets times through, `rate` a second at most."""

    def __init__(self, rate: float) -> None:
        self._step, self._next = 1 / rate, -np.inf

    def due(self, time: float) -> bool:
        if time < self._next - 1e-6:
            return False
        # A late one does not delay those after it, unless it is later than a whole step.
        late = time - self._next >= self._step
        self._next = (time if late else self._next) + self._step
        return True


def of_video(
    path: Path, rate: float, progress: Progress, size: tuple[int, int] | None = None
) -> Iterator[Picture]:
    """Pictures of a video, `rate` a second at most; times as the file stamps them.

    Pictures are as the sensor sees, unless the camera was calibrated for those that players show.

    Args:
        path: of the video.
        rate: pictures a second.
        progress: called with "board" and the part that is done.
        size: of the pictures that the camera was calibrated for, where known.

    Raises:
        InputError: "no-video" or "video-bounds".
    """
    film, pace = film_at(path), _Pace(rate)
    due = [k for k, time in enumerate(film.times.tolist()) if pace.due(time)]
    if len(due) > MAX_PICTURES or film.size[0] * film.size[1] > MAX_PIXELS:
        raise _beyond(path)
    for k, frame in frames_of(path, due):
        grey = np.rot90(frame.to_ndarray(format="gray"), film.turns_for(size))
        yield Picture(float(film.times[k]), np.ascontiguousarray(grey))
        progress("board", (k + 1) / len(film.stamps))


def of_folder(folder: Path, progress: Progress) -> Iterator[Picture]:
    """Pictures of a folder whose times.csv says `file,seconds` in each line.

    Raises:
        InputError: "times-missing", "times-unreadable", "image-damaged" or "video-bounds".
    """
    rows = _times(folder)
    for index, (file, time) in enumerate(rows):
        size = picture_size(file)
        if size is not None and size[0] * size[1] > MAX_PIXELS:
            raise _beyond(file)
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            raise InputError("image-damaged", f"{file.name} is no picture.", where=str(file))
        yield Picture(time, np.asarray(grey, np.uint8))
        progress("board", (index + 1) / len(rows))


def _times(folder: Path) -> list[tuple[Path, float]]:
    path = folder / TIMES
    if not path.is_file():
        raise InputError(
            "times-missing",
            "The folder of pictures does not say when they were taken.",
            where=str(folder),
            fix=f"Add {TIMES} with a line 'file,seconds' for each picture; or give a video.",
        )
    rows: list[tuple[Path, float]] = []
    with path.open(newline="", encoding="utf-8") as file:
        for number, row in enumerate(csv.reader(file), start=1):
            if number == 1 and row[-1:] and not _is_number(row[-1]):
                continue
            name = Path(row[0]).name if row else ""
            if len(row) != 2 or not _is_number(row[1]) or not name.lower().endswith(_SUFFIXES):
                raise InputError(
                    "times-unreadable",
                    f"Line {number} is not 'file,seconds' with a PNG or JPEG.",
                    where=str(path),
                    fix="Write lines such as 0001.png,12.3667.",
                )
            rows.append((folder / name, float(row[1])))
    if len(rows) > MAX_PICTURES:
        raise _beyond(path)
    return sorted(rows, key=lambda row: row[1])


def of_session(session: CaptureSession, rate: float, progress: Progress) -> Iterator[Picture]:
    """Pictures of a session in landscape, `rate` a second at most, on the clock of its poses.

    Raises:
        InputError: "no-video" when the session has neither video nor images.
    """
    times = image_times(session)
    pace = _Pace(rate)
    wanted = {index for index, time in enumerate(times.tolist()) if pace.due(time)}
    stored = _images(session.images, wanted) if session.images else _film(session, wanted)
    for index, grey in stored:
        landscape = np.ascontiguousarray(np.rot90(grey, session.image_turns))
        yield Picture(float(times[index]), landscape)
        progress("board", (index + 1) / len(times))


def _images(files: Sequence[Path], wanted: set[int]) -> Iterator[tuple[int, Grey]]:
    for index in sorted(wanted):
        grey = cv2.imread(str(files[index]), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is not None:
            yield index, np.asarray(grey, np.uint8)


def _film(session: CaptureSession, wanted: set[int]) -> Iterator[tuple[int, Grey]]:
    if session.video is None:
        raise InputError(
            "no-video",
            "The session holds no video and no images.",
            where=str(session.source),
            fix="Record the witness with an app that saves its video, or use a plain video.",
        )
    _, pairs = film_and_pairs(session, session.video)
    image_of = dict(zip(pairs.frames.tolist(), pairs.images.tolist(), strict=True))
    asked = [frame for frame, image in image_of.items() if image in wanted]
    for frame, picture in frames_of(session.video, asked):
        yield image_of[frame], picture.to_ndarray(format="gray")


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def _beyond(path: Path) -> InputError:
    return InputError(
        "video-bounds",
        f"The pictures are more than {MAX_PICTURES}, or larger than {MAX_PIXELS // 10**6} MP.",
        where=str(path),
        fix="Cut out the part that shows the board, a minute or two.",
    )


RATE = 15.0
"""Pictures a second that are looked at."""
MIN_POSES = 10
_SAMPLES = 4
"""Pictures looked at once more to find out what is wrong; up to twice as many are kept."""
_MAX_OFF = 0.1
"""Error of the corners, as a part of a square's side in the picture, that a right board has at most."""


@dataclass(frozen=True)
class BoardTrack:
    """Poses of a board in the frame of the camera that saw it, and what they rest on."""

    times: Float64[np.ndarray, " poses"]
    """Seconds on the camera's clock, increasing; not evenly spaced."""
    T_camera_board: Float64[np.ndarray, "poses 4 4"]
    """OpenCV's camera axes (x right, y down, z ahead); the frame of `Grid`."""
    covariance: Float64[np.ndarray, "poses 6 6"]
    """Covariance of each pose, in the camera's axes, as in `BoardPoses`."""
    rms: Float64[np.ndarray, " poses"]
    """Pixels."""
    corners: Int[np.ndarray, " poses"]
    """How many each pose rests on."""
    pixels: list[Float64[np.ndarray, "_ 2"]]
    """Pixels of the corners found in the picture of each pose."""
    numbers: list[Int[np.ndarray, " _"]]
    """Numbers of the same corners, as in `Grid.corners`."""
    board: Board | Checkerboard
    camera: WitnessCamera
    sigma: float
    """Error of a corner along each axis, pixels."""
    pictures: int
    """How many were searched; those that leave the board's tilt ambiguous have no pose."""
    T_world_camera: Float64[np.ndarray, "poses 4 4"] | None = None
    """Poses of the camera, if it is a phone that logs them: its ARKit world, OpenCV axes."""


@dataclass
class _Seen:
    """What is kept of the pictures; its size does not grow with their number."""

    source: str
    size: tuple[int, int] = (0, 0)
    times: list[float] = field(default_factory=list[float])
    found: list[Corners] = field(default_factory=list[Corners])
    samples: list[Grey] = field(default_factory=list[Grey])


def track_video(
    path: Path,
    board: Board | Checkerboard,
    camera: WitnessCamera | None = None,
    *,
    rate: float = RATE,
    progress: Progress = lambda name, done: None,
) -> BoardTrack:
    """The board in a video, or in a folder of pictures with times.csv.

    A wrong size of the squares cannot be seen: all distances come out wrong by the same factor.

    Args:
        path: video file or folder.
        board: as printed and measured.
        camera: its intrinsics; without them they are calibrated from the same pictures.
        rate: pictures looked at in a second of video.
        progress: called with "board" and the part that is done.

    Raises:
        InputError: no readable video; "board-not-seen", "board-dictionary-other", "board-mirrored",
            "board-layout", "board-few"; "camera-size" or "camera-calibration".
    """
    size = camera.size if camera else None
    pictures = of_folder(path, progress) if path.is_dir() else of_video(path, rate, progress, size)
    seen = _look(pictures, board, str(path))
    camera = camera.at(*seen.size) if camera else _calibrated(seen, board)
    poses = _poses(seen, board, camera.K, camera.lens)
    return _track(seen, board, poses, camera)


def track_session(
    session: CaptureSession,
    board: Board | Checkerboard,
    *,
    rate: float = RATE,
    progress: Progress = lambda name, done: None,
) -> BoardTrack:
    """The board as another phone saw it, which logs its own intrinsics and poses (fixed or not).

    Raises:
        InputError: as `track_video`; "no-intrinsics" when the session has none.
    """
    if session.intrinsics is None or session.image_size is None:
        raise InputError(
            "no-intrinsics",
            f"{session.app} does not say what camera it was.",
            where=str(session.source),
            fix="Give the video itself, with the camera's intrinsics or without.",
        )
    seen = _look(of_session(session, rate, progress), board, str(session.source))
    nearest = _nearest(session.times, np.array(seen.times))
    intrinsics = session.intrinsics[nearest]
    shrink = seen.size[0] / session.image_size[0]
    K = np.zeros((len(nearest), 3, 3))
    K[:, [0, 1], [0, 1]] = shrink * intrinsics[:, :2]
    K[:, :2, 2] = shrink * (intrinsics[:, 2:] + 0.5) - 0.5
    K[:, 2, 2] = 1
    poses = _poses(seen, board, K, np.zeros(5))
    middle = np.median(K, axis=0)
    camera = WitnessCamera(
        middle[0, 0], middle[1, 1], middle[0, 2], middle[1, 2], size=seen.size, source=session.app
    )
    T = session.T_world_phone[nearest] @ T_OPENCV_ARKIT_CAMERA
    return _track(seen, board, poses, camera, T)


def with_camera(track: BoardTrack, camera: WitnessCamera) -> BoardTrack:
    """The same corners as another camera would explain them, fixed for all pictures.

    Shows what an error of the intrinsics, which all poses share, does to them.

    Args:
        track: of a video.
        camera: for pictures of the same size.
    """
    poses = board_poses(track.pixels, track.numbers, track.board, camera.K, camera.lens)
    kept = poses.frames
    return replace(
        track,
        times=track.times[kept],
        T_camera_board=poses.T_camera_board,
        covariance=poses.covariance,
        rms=poses.rms,
        corners=poses.corners,
        pixels=[track.pixels[i] for i in kept],
        numbers=[track.numbers[i] for i in kept],
        camera=camera,
        sigma=poses.sigma,
        T_world_camera=None if track.T_world_camera is None else track.T_world_camera[kept],
    )


def _look(pictures: Iterator[Picture], board: Board | Checkerboard, source: str) -> _Seen:
    """Find the board in each picture."""
    detector, seen, every = Detector(board), _Seen(source), 1
    for picture in pictures:
        height, width = picture.grey.shape
        if seen.size not in ((0, 0), (width, height)):
            raise InputError(
                "camera-size",
                f"The pictures change their size, from {seen.size[0]}x{seen.size[1]} to "
                f"{width}x{height}.",
                where=source,
                fix="Give pictures of one camera in one mode.",
            )
        seen.size = (width, height)
        seen.times.append(picture.time)
        seen.found.append(detector.find(picture.grey))
        if (len(seen.times) - 1) % every == 0:
            seen.samples.append(picture.grey)
            if len(seen.samples) > 2 * _SAMPLES:
                seen.samples, every = seen.samples[::2], 2 * every
    if not seen.times:
        raise InputError("no-video", "There are no pictures.", where=source, fix="Film the board.")
    shown = sum(len(f.numbers) >= MIN_CORNERS for f in seen.found)
    if shown < MIN_POSES or not fits(seen.samples, board):
        raise _explained(seen, board, shown)
    return seen


def _explained(seen: _Seen, board: Board | Checkerboard, shown: int) -> InputError:
    """The error for pictures that hardly show the board."""
    if shown and fits(seen.samples, board):
        return InputError(
            "board-few",
            f"Only {shown} of {len(seen.times)} pictures show {MIN_CORNERS} corners of the board.",
            where=seen.source,
            fix="Keep the whole board in view, well lit and not too fast, for half a minute.",
        )
    return not_found(seen.samples[:: -(-len(seen.samples) // _SAMPLES)], board, seen.source)


def _calibrated(seen: _Seen, board: Board | Checkerboard) -> WitnessCamera:
    pixels, numbers = [f.pixels for f in seen.found], [f.numbers for f in seen.found]
    return calibrate_camera(pixels, numbers, board, seen.size)


def _poses(
    seen: _Seen,
    board: Board | Checkerboard,
    K: Float64[np.ndarray, "*frames 3 3"],
    lens: Float64[np.ndarray, " coefficients"],
) -> BoardPoses:
    """The poses, or the error that says that they are none of this board."""
    pixels, numbers = [f.pixels for f in seen.found], [f.numbers for f in seen.found]
    poses = board_poses(pixels, numbers, board, K, lens)
    sure = int((~poses.ambiguous).sum())
    if sure < MIN_POSES:
        raise InputError(
            "board-few",
            f"{sure} of {len(seen.times)} pictures tell the board's pose; {len(poses.frames)} show "
            "enough of it.",
            where=seen.source,
            fix="Film the board larger, and tilted to the camera by 20 degrees or more.",
        )
    focal = float(np.mean(K[..., 0, 0]))
    side = focal * board.square / float(np.median(poses.T_camera_board[:, 2, 3]))
    if poses.sigma > _MAX_OFF * side:
        raise InputError(
            "board-reprojection",
            f"The corners are {poses.sigma:.1f} px off any pose of the board, whose squares are "
            f"{side:.0f} px.",
            where=seen.source,
            fix="Check the intrinsics and the board's text; the board must be flat and stiff.",
        )
    return poses


def _track(
    seen: _Seen,
    board: Board | Checkerboard,
    poses: BoardPoses,
    camera: WitnessCamera,
    T_world_camera: Float64[np.ndarray, "pictures 4 4"] | None = None,
) -> BoardTrack:
    sure = ~poses.ambiguous
    frames = poses.frames[sure]
    return BoardTrack(
        times=np.array(seen.times)[frames],
        T_camera_board=poses.T_camera_board[sure],
        covariance=poses.covariance[sure],
        rms=poses.rms[sure],
        corners=poses.corners[sure],
        pixels=[seen.found[i].pixels for i in frames],
        numbers=[seen.found[i].numbers for i in frames],
        board=board,
        camera=camera,
        sigma=poses.sigma,
        pictures=len(seen.times),
        T_world_camera=None if T_world_camera is None else T_world_camera[frames],
    )


def _nearest(
    times: Float64[np.ndarray, " poses"], wanted: Float64[np.ndarray, " pictures"]
) -> Int[np.ndarray, " pictures"]:
    after = np.searchsorted(times, wanted).clip(1, len(times) - 1)
    return after - (wanted - times[after - 1] < times[after] - wanted)
