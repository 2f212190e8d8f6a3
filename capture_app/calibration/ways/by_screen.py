"""Mounts by pictures of the phone's screen, which shows a board."""

from collections.abc import Iterator
from pathlib import Path

from capture_app.calibration.phones import need, phone_of
from capture_app.commands.calibrate.by_camera import ScreenWay
from ingest.archive import is_archive, unpack
from ingest.calibration.board.camera import load_camera
from ingest.calibration.board.place import load_place
from ingest.calibration.board.spec import Board, parse_board
from ingest.calibration.pose_file import load_similarity
from ingest.calibration.screen.screen import (
    ScreenViews,
    learned_screen,
    mount_from_screen,
    screen_object,
)
from ingest.calibration.screen.shown import ScreenPose, load_screen_pose, screen_pose, shown_board
from ingest.calibration.screen.views import Photo, photos, views_in_model, views_with_board
from ingest.mount import Mount
from ingest.mount_file import load_mount


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
    fixed = parse_board(way.board)
    camera = load_camera(way.camera) if way.camera else None
    place = load_place(way.place, fixed)
    return views_with_board(_photos(way.photos), shown, fixed, place, camera)


def _photos(path: Path) -> Iterator[Photo]:
    """Of a folder, or of an archive of one."""
    return photos(unpack(path) if path.is_file() and is_archive(path) else path)
