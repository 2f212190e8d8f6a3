"""The pose of a camera that watched, in a result's world, and the offset of its clock."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float64, Int64
from scipy.optimize import minimize_scalar

from capture_app.commands.overlay import OverlayRequest
from capture_app.overlay.overlay_film import TimedPictures, Watcher
from capture_app.progress import Progress
from ingest.calibration.board.board_lens import distorted
from ingest.calibration.board.board_track import BoardTrack
from ingest.calibration.hand_eye.hand_eye import solve
from ingest.calibration.hand_eye.hand_eye_guess import find_offsets, peak
from ingest.calibration.hand_eye.hand_eye_model import PHONE_SD, PoseStream
from ingest.calibration.hand_eye.to_mount import stream_of
from ingest.calibration.pose_file import load_similarity
from ingest.calibration.posterior import average
from ingest.calibration.scan_landmarks import read_landmarks
from ingest.calibration.scan_mount import PhonePicture, localise
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.session_images import pictures_damaged
from ingest.uncertainty import between
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMotion

_NEAR = 0.15
"""Seconds around a guess of the offset in which the best one is sought."""
_LEVER = 0.5
"""Metres at which a turn counts like a shift, when offsets are compared."""
_FEWEST = 5
_ENOUGH = 100
"""Poses that are averaged at most: each is compared with each."""
_DOUBT = np.diag(PHONE_SD**2)


@dataclass(frozen=True)
class FilmPlacement:
    """How a watcher's world and clock hang together with the result's."""

    T_world_rest: Float64[np.ndarray, "4 4"]
    """Maps the frame in which the watcher moves into the result's world."""
    offset: float
    """Seconds to add to the film's times; 0 is then frame 0 of the result."""


def motion_stream(moved: ObjectMotion) -> PoseStream:
    """The measured poses of the object on the clock of the result."""
    return PoseStream(np.flatnonzero(moved.valid) / FPS, moved.T_world_object[moved.valid])


def by_board_on_object(
    moved: ObjectMotion,
    track: BoardTrack,
    T_object_board: Float64[np.ndarray, "4 4"] | None,
    offset: float | None,
) -> FilmPlacement:
    """Return the place of a camera that saw a board which moved with the object.

    Args:
        moved: the object.
        track: of the board in the film.
        T_object_board: where the board is on the object; without it the motion has to show it too.
        offset: of the clocks; without it the motion has to show it too.

    Raises:
        InputError: those of `ingest.calibration.hand_eye.hand_eye.solve`, or "overlay-no-overlap".
    """
    motion, board = motion_stream(moved), stream_of(track)
    if T_object_board is None:
        found = solve(motion, board)
        T = found.T_world_camera[found.kept]
        return FilmPlacement(agreed(T), found.offset if offset is None else offset)
    if offset is None:
        guesses = find_offsets(motion, board)
        best = min(_closest(motion, board, T_object_board, g.seconds) for g in guesses)
        offset = best[1]
    return FilmPlacement(agreed(_stations(motion, board, T_object_board, offset)), offset)


def by_board_in_room(
    T_world_board: Float64[np.ndarray, "4 4"], T_rest_board: Float64[np.ndarray, "n 4 4"]
) -> Float64[np.ndarray, "4 4"]:
    """T_world_rest, from sightings of a board that did not move and is known in the world."""
    return agreed(T_world_board @ inverse(T_rest_board))


def board_in_room(
    T_world_arkit: Float64[np.ndarray, "4 4"], T_arkit_board: Float64[np.ndarray, "n 4 4"]
) -> Float64[np.ndarray, "4 4"]:
    """T_world_board of a board that did not move, as the clamped phone saw it in its own world."""
    return T_world_arkit @ agreed(T_arkit_board)


def arkit_world(
    moved: ObjectMotion, session: CaptureSession, mount: Mount
) -> Float64[np.ndarray, "4 4"]:
    """T_world_arkit of a result: maps the world of the clamped phone's session into the result's."""
    times = session.times[0] + moved.start_time + np.arange(len(moved.valid)) / FPS
    phone = PoseStream(session.times, session.T_world_phone)
    good = moved.valid & phone.known(times)
    T_world_phone = moved.T_world_object @ inverse(mount.T_phone_object)
    return agreed((T_world_phone @ inverse(phone.at(times)))[good])


def riding(
    moved: ObjectMotion, mount: Mount, seconds: Float64[np.ndarray, " pictures"]
) -> Float64[np.ndarray, "pictures 4 4"]:
    """T_world_camera (OpenCV's axes) of the clamped phone at seconds of the result.

    It follows the object as the result has it, so that what is drawn stays where it is on it.
    """
    poses = PoseStream(np.arange(len(moved.valid)) / FPS, moved.T_world_object).at(seconds)
    return poses @ inverse(mount.T_phone_object) @ T_OPENCV_ARKIT_CAMERA


def _stations(
    motion: PoseStream, board: PoseStream, T_object_board: Float64[np.ndarray, "4 4"], offset: float
) -> Float64[np.ndarray, "n 4 4"]:
    """T_world_rest as each sighting of the board has it."""
    both = motion.known(board.times + offset)
    if both.sum() < _FEWEST:
        raise InputError(
            "overlay-no-overlap",
            f"The board is seen in {int(both.sum())} pictures of the time in which the object's motion "
            "is known.",
            fix="Give another ‹offset›, or leave it out to have it found; the board must be seen while "
            "the object moves.",
        )
    T_world_object = motion.at(board.times[both] + offset)
    return T_world_object @ T_object_board @ inverse(board.T[both])


def _closest(
    motion: PoseStream, board: PoseStream, T_object_board: Float64[np.ndarray, "4 4"], guess: float
) -> tuple[float, float]:
    """The offset near a guess at which a resting camera rests most, after how little it does."""

    def restlessness(offset: float) -> float:
        T = _stations(motion, board, T_object_board, offset)
        step = between(agreed(T)[None], T).reshape(-1, 2, 3)
        turn, shift = np.linalg.norm(step, axis=-1).T
        return float(np.median(_LEVER * turn + shift))

    found = minimize_scalar(
        restlessness,
        bounds=(guess - _NEAR, guess + _NEAR),
        method="bounded",
        options={"xatol": 1e-4},
    )
    return float(found.fun), float(found.x)


def agreed(T: Float64[np.ndarray, "n 4 4"]) -> Float64[np.ndarray, "4 4"]:
    """Return the pose that most of them agree on, from some of them where there are many."""
    some = T[:: -(-len(T) // _ENOUGH)]
    return average(some, np.tile(_DOUBT, (len(some), 1, 1))).T


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
            field="scanned_at",
            fix="Give a second of the motion at which the object stood where it was scanned.",
        )
    return frame


def _view(watcher: Watcher, k: int) -> PhonePicture:
    """One of its pictures without the lens' distortion."""
    found = next(watcher.film.read(k, k + 1), None)
    if found is None:
        raise pictures_damaged([watcher.film.name(k)], 1, watcher.film.source)
    fx, fy, cx, cy = watcher.intrinsics[k]
    grey = cv2.cvtColor(found[1], cv2.COLOR_RGB2GRAY)
    if watcher.lens.any():
        grey = cv2.undistort(grey, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), watcher.lens)
    name = f"{watcher.film.source}, {watcher.film.times[k]:.2f} s"
    return PhonePicture(name, np.asarray(grey, np.uint8), watcher.intrinsics[k])


_WIDTH = 240
"""Pixels across the reduced pictures."""
_RATE = 15.0
"""Pictures a second that are looked at, at most."""
_STEP = 1 / 30
"""Seconds between the offsets that are tried."""
_LEAST_OVERLAP = 0.4
"""Part of the shorter of film and motion that must lie within the other."""
_NOISE = 6
"""Grey levels that a picture that shows the same may differ by."""
_SURE = 0.5
"""Least correlation of a right offset."""
_APART = 0.5
"""Least distance between two different offsets, seconds."""
_RIVAL = 0.9
"""Most correlation of another offset, as a share of the best one's."""


def clock_offset(
    film: TimedPictures,
    moved: ObjectMotion,
    T_world_camera: Float64[np.ndarray, "4 4"],
    K: Float64[np.ndarray, "3 3"],
    lens: Float64[np.ndarray, " coefficients"],
) -> float:
    """Seconds to add to the film's times to get the motion's.

    Where the object would be in a picture, the film changes as fast as the object would move across
    it: the offset at which the two agree best over the whole film.

    Args:
        film: of a camera that stood still.
        moved: the object in the world.
        T_world_camera: OpenCV's axes (x right, y down, z ahead).
        K, lens: of the film's pixels, and OpenCV's distortion.

    Raises:
        InputError: "offset-needed" when no offset fits, or several do.
    """
    times, changed = _changes(film)
    boxes, speed = _seen(moved, T_world_camera, K, lens, _WIDTH / film.size[0])
    length = (len(speed) - 1) / FPS
    offsets = np.arange(-times[-1], length - times[0], _STEP)
    score = np.array([_agreement(times + o, changed, boxes, speed, length) for o in offsets])
    best = int(score.argmax())
    far = np.abs(offsets - offsets[best]) > _APART
    rival = float(score[far].max(initial=0.0))
    if score[best] < _SURE or rival > _RIVAL * score[best]:
        raise InputError(
            "offset-needed",
            "What moves in the film does not tell when it was taken: "
            + (
                f"at best it agrees with the object's motion by {score[best]:.2f} of 1."
                if score[best] < _SURE
                else f"{offsets[best]:.1f} s and {offsets[far][score[far].argmax()]:.1f} s fit alike."
            ),
            where=str(film.source),
            fix="Give ‹offset› SECONDS: what to add to the film's time to get the motion's, such as "
            "the time in the motion minus that in the film at which the object leaves the floor.",
        )
    return float(offsets[best] + _STEP * peak(score, best))


def _changes(film: TimedPictures) -> tuple[Float64[np.ndarray, " n"], Int64[np.ndarray, "n h w"]]:
    """Middle times of picture pairs, and sums of grey change left of and above each pixel."""
    every = max(1, round(1 / (_RATE * float(np.median(np.diff(film.times))))))
    height = round(film.size[1] * _WIDTH / film.size[0])
    sums: list[np.ndarray] = []
    kept: list[float] = []
    before = None
    for k, picture in film.read(0, len(film.times)):
        if k % every:
            continue
        kept.append(float(film.times[k]))
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        grey = cv2.resize(grey, (_WIDTH, height), interpolation=cv2.INTER_AREA)
        if before is not None:
            change = cv2.absdiff(grey, before)
            sums.append(cv2.integral(np.where(change > _NOISE, change, 0).astype(np.uint8)))
        before = grey
    times = np.array(kept)
    return (times[1:] + times[:-1]) / 2, np.array(sums, np.int64)


def _seen(
    moved: ObjectMotion,
    T_world_camera: Float64[np.ndarray, "4 4"],
    K: Float64[np.ndarray, "3 3"],
    lens: Float64[np.ndarray, " coefficients"],
    shrink: float,
) -> tuple[Float64[np.ndarray, "frames 4"], Float64[np.ndarray, " frames"]]:
    """Left, top, right, bottom of the object in the reduced pictures; pixels a second it moves."""
    some = moved.mesh.vertices[:: max(1, len(moved.mesh.vertices) // 200)]
    T = inverse(T_world_camera) @ moved.T_world_object
    points = some @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    flat = points[..., :2] / np.maximum(points[..., 2:], 0.05)
    bent = distorted(flat.reshape(-1, 2), lens).reshape(flat.shape) if lens.any() else flat
    pixels = shrink * (bent * K[[0, 1], [0, 1]] + K[:2, 2])
    steps = np.linalg.norm(np.gradient(pixels, 1 / FPS, axis=0), axis=-1).mean(axis=1)
    ahead = (points[..., 2] > 0.05).all(axis=1)
    return np.concatenate([pixels.min(axis=1), pixels.max(axis=1)], axis=1), np.where(
        ahead, steps, np.nan
    )


def _agreement(
    at: Float64[np.ndarray, " n"],
    changed: Int64[np.ndarray, "n h w"],
    boxes: Float64[np.ndarray, "frames 4"],
    speed: Float64[np.ndarray, " frames"],
    length: float,
) -> float:
    """Correlation of how much the film changes where the object is with how fast it moves there."""
    inside = np.flatnonzero((at >= 0) & (at <= length))
    if (at[inside].max(initial=0) - at[inside].min(initial=length)) < _LEAST_OVERLAP * min(
        length, at[-1] - at[0]
    ):
        return 0.0
    frame = np.rint(at[inside] * FPS).astype(int)
    height, width = changed.shape[1] - 1, changed.shape[2] - 1
    box = boxes[frame].clip(0, [width, height, width, height]).round().astype(int)
    area = (box[:, 2] - box[:, 0]) * (box[:, 3] - box[:, 1])
    good = (area > 0) & np.isfinite(speed[frame])
    x0, y0, x1, y1 = box[good].T
    k = inside[good]
    sums = changed[k, y1, x1] - changed[k, y0, x1] - changed[k, y1, x0] + changed[k, y0, x0]
    a, b = np.log1p(sums / area[good]), np.log1p(speed[frame[good]])
    if len(a) < 3 or a.std() < 1e-6 or b.std() < 1e-6:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])
