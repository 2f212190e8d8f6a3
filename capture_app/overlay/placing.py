"""Where a camera that watched stood in a result's world, and how far its clock is off."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.optimize import minimize_scalar

from ingest.calibration.board.board_track import BoardTrack
from ingest.calibration.hand_eye.hand_eye import solve
from ingest.calibration.hand_eye.hand_eye_guess import find_offsets
from ingest.calibration.hand_eye.hand_eye_model import PHONE_SD, PoseStream
from ingest.calibration.hand_eye.to_mount import stream_of
from ingest.calibration.posterior import average
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.mount import Mount
from ingest.session import CaptureSession
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
    """From a board that moved with the object.

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
            fix="Give another --offset, or leave it out to have it found; the board must be seen while "
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
