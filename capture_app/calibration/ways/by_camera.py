"""Mounts by what else watched: a camera that filmed a board, a tracker, or pictures of the screen."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from capture_app.calibration.phones import need, phone_of
from capture_app.commands.calibrate.by_camera import BoardWay, ScreenWay, TrackerWay
from capture_app.commands.calibrate.way import Way
from capture_app.progress import Progress
from ingest.archive import is_archive, unpack
from ingest.calibration.board.board_place import load_place, parse_grid
from ingest.calibration.board.board_spec import Board, Checkerboard
from ingest.calibration.board.board_track import TIMES, BoardTrack, track_session, track_video
from ingest.calibration.board.camera_file import load_camera
from ingest.calibration.hand_eye.to_mount import (
    calibrate_by_board,
    calibrate_by_motion,
    phone_stream,
    read_pose_log,
)
from ingest.calibration.pose_file import load_pose, load_similarity
from ingest.calibration.screen.screen import (
    ScreenViews,
    learned_screen,
    mount_from_screen,
    screen_object,
)
from ingest.calibration.screen.shown import ScreenPose, load_screen_pose, screen_pose, shown_board
from ingest.calibration.screen.views import Photo, photos, views_in_model, views_with_board
from ingest.formats.registry import read_session
from ingest.mount import Mount
from ingest.mount_file import load_mount
from omomo_core.geometry.transforms import inverse


def by_board(way: BoardWay, progress: Progress) -> Mount:
    """By the film of a board on the object; progress is called with the stage "board".

    Raises:
        InputError: of what is read, of the track, and of `calibrate_by_board`.
    """
    _check_object(way)
    board = parse_grid(way.board)
    place = load_place(way.place, board)
    stream = phone_stream(read_session(way.session, way.format))
    return calibrate_by_board(stream, _track(way, board, progress), place)


def _track(way: BoardWay, board: Board | Checkerboard, progress: Progress) -> BoardTrack:
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


def by_screen(way: ScreenWay) -> Mount:
    """By the board on the screen, seen together with the object.

    Raises:
        InputError: "phone-needed", those of what is read, and of `mount_from_screen`.
    """
    phone = need(phone_of(way.phone, way.ruler))
    shown = shown_board(phone, way.turned)
    pose = load_screen_pose(way.phone_file) if way.phone_file else screen_pose(phone)
    views = see(way, shown)
    return mount_from_screen(views, shown, pose, turned=way.turned, scaled=way.scale, phone=phone)


def learned_pose(way: ScreenWay, known: Path) -> ScreenPose:
    """Where the screen is in this phone, by a mount of the same clamping that is known.

    Raises:
        InputError: as `by_screen`.
    """
    phone = need(phone_of(way.phone, way.ruler))
    shown = shown_board(phone, way.turned)
    views = see(way, shown)
    placed = screen_object(views, shown, turned=way.turned, scaled=way.scale, phone=phone)
    return learned_screen(placed, load_mount(known))


def see(way: ScreenWay, shown: Board) -> ScreenViews:
    """Read the pictures into poses, by the board on the object or by the scan's model.

    Raises:
        InputError: of what is read.
    """
    if way.model is not None:
        T, scale = load_similarity(way.to_object) if way.to_object else (None, 1.0)
        return views_in_model(_photos(way.photos), shown, way.model, T, scale)
    assert way.board is not None
    assert way.place is not None
    fixed = parse_grid(way.board)
    camera = load_camera(way.camera) if way.camera else None
    place = load_place(way.place, fixed)
    return views_with_board(_photos(way.photos), shown, fixed, place, camera)


def _photos(path: Path) -> Iterator[Photo]:
    """Of a folder, or of an archive of one."""
    return photos(unpack(path) if path.is_file() and is_archive(path) else path)
