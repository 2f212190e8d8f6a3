"""Mounts by what else watched: a camera that filmed a board, or a tracker."""

import numpy as np

from capture_app.commands.calibrate.by_camera import BoardWay, TrackerWay
from capture_app.commands.calibrate.way import Way
from capture_app.progress import Progress
from ingest.archive import is_archive
from ingest.calibration.board.camera import load_camera
from ingest.calibration.board.pictures import TIMES
from ingest.calibration.board.place import load_place
from ingest.calibration.board.spec import Board, parse_board
from ingest.calibration.board.track import BoardTrack, track_session, track_video
from ingest.calibration.hand_eye.board import calibrate_by_board
from ingest.calibration.hand_eye.phone import phone_stream
from ingest.calibration.hand_eye.pose_log import read_pose_log
from ingest.calibration.hand_eye.to_mount import calibrate_by_motion
from ingest.calibration.pose_file import load_pose
from ingest.formats.detect import read_session
from ingest.mount import Mount
from omomo_core.geometry.transforms import inverse


def by_board(way: BoardWay, progress: Progress) -> Mount:
    """By the film of a board on the object; progress is called with the stage "board".

    Raises:
        InputError: of what is read, of the track, and of `calibrate_by_board`.
    """
    _check_object(way)
    board = parse_board(way.board)
    place = load_place(way.place, board)
    stream = phone_stream(read_session(way.session, way.format))
    return calibrate_by_board(stream, _track(way, board, progress), place)


def _track(way: BoardWay, board: Board, progress: Progress) -> BoardTrack:
    """By what the film is: a second phone's session brings its own intrinsics and poses."""
    known = load_camera(way.camera) if way.camera else None
    film = way.film
    video = film.is_file() and not is_archive(film)
    if video or (film / TIMES).is_file() or not film.exists():
        return track_video(film, board, known, progress=progress)
    return track_session(read_session(film), board, progress=progress)


def by_tracker(way: TrackerWay) -> Mount:
    """By the log of a tracker that followed the same motion.

    Raises:
        InputError: of what is read, and of `calibrate_by_motion`.
    """
    _check_object(way)
    T_object_body = load_pose(way.body) if way.body else np.eye(4)
    return calibrate_by_motion(
        phone_stream(read_session(way.session, way.format)),
        read_pose_log(way.poses),
        inverse(T_object_body),
        np.zeros((6, 6)),
        "tracker",
    )


def _check_object(way: Way) -> None:
    """Refuse a mesh that cannot be read before the slow part."""
    if way.mesh_file is not None:
        way.mesh_file.load()
