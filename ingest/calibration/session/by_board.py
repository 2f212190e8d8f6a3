"""Where the object stood, by a board on it that the phone saw before it was clamped."""

import numpy as np

from ingest.calibration.average import average
from ingest.calibration.board.place import BoardPlace
from ingest.calibration.board.track import BoardTrack
from ingest.calibration.session.session import ObjectPlacement
from ingest.session import CaptureSession
from ingest.uncertainty import between, of_inverse, of_product
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_MIN_SEEN = 10
_POSE = np.diag([np.radians(0.1) ** 2] * 3 + [0.001**2] * 3)
"""Covariance of each of the phone's poses (rad, m)."""
_LENS = np.diag([np.radians(0.1) ** 2] * 3 + [0.0015**2] * 3)
"""Of what all pictures of one camera share (rad, m)."""


def placed_by_board(
    session: CaptureSession, track: BoardTrack, place: BoardPlace, before: float
) -> ObjectPlacement:
    """The object where the board on it was seen.

    Args:
        session: the log.
        track: the board in the session's own pictures.
        place: the board on the object.
        before: seconds from the start of the log when the phone was clamped.

    Raises:
        InputError: "board-few" when the board was hardly seen before the clamping.
    """
    seconds = track.times - session.times[0]
    chosen = np.flatnonzero(seconds < before)
    if track.T_world_camera is None or len(chosen) < _MIN_SEEN:
        raise InputError(
            "board-few",
            f"The phone saw the board in {len(chosen)} pictures before it was clamped.",
            where=str(session.source),
            fix="Film the board on the object from several sides for ten seconds, then clamp the "
            "phone without stopping the log.",
        )
    T_world_camera = track.T_world_camera[chosen]
    T = T_world_camera @ track.T_camera_board[chosen]
    covariances = np.array(
        [
            of_product(camera, _POSE, board, covariance)
            for camera, board, covariance in zip(
                T_world_camera, track.T_camera_board[chosen], track.covariance[chosen], strict=True
            )
        ]
    )
    mean = average(T, covariances)
    off = between(mean.T[None], T[mean.kept]).reshape(-1, 2, 3)
    turn, shift = np.sqrt((off**2).sum(axis=-1).mean(axis=0))
    T_board_object = inverse(place.T_object_board)
    covariance = of_product(
        mean.T,
        mean.covariance + _LENS,
        T_board_object,
        of_inverse(place.T_object_board, place.covariance),
    )
    return ObjectPlacement(
        mean.T @ T_board_object,
        covariance,
        float(seconds[chosen[-1]]),
        {
            "board_mm": 1e3 * float(shift),
            "board_deg": float(np.degrees(turn)),
            "board_seen": float(mean.kept.sum()),
        },
    )
