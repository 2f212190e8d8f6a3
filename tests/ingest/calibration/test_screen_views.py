"""Pictures of the screen and the object become poses: by a board, and by a COLMAP model."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest

from ingest.calibration.board.board_place import BoardPlace
from ingest.calibration.board.board_spec import Board, board_image
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.calibration.phone_body import phone_named
from ingest.calibration.screen.screen import mount_from_screen
from ingest.calibration.screen.shown import screen_board, screen_of_board, screen_pose
from ingest.calibration.screen.views import Photo, photos, views_in_model, views_with_board
from ingest.uncertainty import between, bounds_95, moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.calibration.around_the_phone import cameras

PHONE = phone_named("iPhone 15")
FIXED = Board(5, 7, 0.035, 0.026)
PLACE = np.diag([1e-3**2] * 3 + [5e-4**2] * 3)
K = np.array([[1500.0, 0, 960], [0, 1500, 720], [0, 0, 1]])


def _painted(T_camera_board: np.ndarray, board: Board, canvas: np.ndarray) -> None:
    """Draw a board into a picture as a camera at K sees it."""
    per_metre = 6000
    width, height = (round(per_metre * s) for s in (board.width, board.height))
    drawn = board_image(board, width, height, per_metre / 1e3)
    to_board = np.array(
        [[1 / per_metre, 0, 0.5 / per_metre], [0, 1 / per_metre, 0.5 / per_metre], [0, 0, 1]]
    )
    H = K @ T_camera_board[:3, [0, 1, 3]] @ to_board
    size = canvas.shape[::-1]
    mask = cv2.warpPerspective(np.full_like(drawn, 255), H, size, flags=cv2.INTER_AREA)
    warped = cv2.warpPerspective(drawn, H, size, flags=cv2.INTER_AREA)
    canvas[mask > 0] = warped[mask > 0]


def test_pictures_become_a_mount(tmp_path: Path):
    rng = np.random.default_rng(9)
    T_object_board = moved(np.eye(4), rng.normal(size=6) * 0.02)
    T_screen_object = np.eye(4)
    T_screen_object[:3, 3] = [0.05, -0.12, 0.03]
    shown = screen_board(PHONE)
    for k, T_sc in enumerate(cameras(rng, 4)):
        canvas = np.full((1440, 1920), 200, np.uint8)
        T_cs = inverse(T_sc)
        _painted(T_cs @ T_screen_object @ T_object_board, FIXED, canvas)
        _painted(T_cs @ screen_of_board(shown, 0), shown, canvas)
        cv2.imwrite(str(tmp_path / f"{k}.png"), cv2.GaussianBlur(canvas, (3, 3), 0))
    camera = WitnessCamera(1500.0, 1500.0, 960.0, 720.0, size=(1920, 1440))
    place = BoardPlace(T_object_board, PLACE, 0.0)
    views = views_with_board(photos(tmp_path), shown, FIXED, place, camera)
    mount = mount_from_screen(views, shown, screen_pose(PHONE), phone=PHONE)
    assert mount.covariance is not None
    off = between(mount.T_phone_object, screen_pose(PHONE).T_phone_screen @ T_screen_object)
    assert 1e3 * np.linalg.norm(off[3:]) < bounds_95(mount.covariance).mm
    assert np.linalg.norm(off[3:]) < 0.004
    blank = [Photo("a", np.full((480, 640), 255, np.uint8))]
    with pytest.raises(InputError) as caught:
        views_with_board(blank, shown, FIXED, place, replace(camera, size=None))
    assert caught.value.code == "screen-unseen"
    with pytest.raises(InputError) as caught:
        next(photos(tmp_path / "empty"))
    assert caught.value.code == "no-pictures"


def _model(folder: Path, T_camera_model: np.ndarray, kind: str = "OPENCV") -> Path:
    """A COLMAP model of these cameras, whose pictures are 0.png, 1.png..."""
    model = pycolmap.Reconstruction()
    known = {"OPENCV": [1500, 1500, 960.5, 720.5, 0, 0, 0, 0], "OPENCV_FISHEYE": [1500.0] * 8}
    camera = pycolmap.Camera(model=kind, width=1920, height=1440, params=known[kind], camera_id=1)
    model.add_camera_with_trivial_rig(camera)
    for k, T in enumerate(T_camera_model):
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(T[:3, :3]), T[:3, 3])
        image = pycolmap.Image(name=f"scan/{k}.png", camera_id=1, image_id=k + 1)
        model.add_image_with_trivial_frame(image, pose)
    folder.mkdir()
    model.write(str(folder))
    return folder


def test_pictures_of_a_scan_become_a_mount(tmp_path: Path):
    rng = np.random.default_rng(10)
    T_screen_object = moved(np.eye(4), np.array([0.2, -0.1, 0.3, 0.05, 0.1, -0.2]))
    T_object_model = moved(np.eye(4), rng.normal(size=6) * 0.3)
    scale = 0.5
    shown = screen_board(PHONE)
    T_camera_model = []
    for k, T_sc in enumerate(cameras(rng, 4)):
        canvas = np.full((1440, 1920), 200, np.uint8)
        _painted(inverse(T_sc) @ screen_of_board(shown, 0), shown, canvas)
        cv2.imwrite(str(tmp_path / f"{k}.png"), canvas)
        T = inverse(T_sc) @ T_screen_object @ T_object_model
        T[:3, 3] /= scale
        T_camera_model.append(T)
    model = _model(tmp_path / "sparse", np.array(T_camera_model))
    views = views_in_model(photos(tmp_path), shown, model, T_object_model, scale)
    mount = mount_from_screen(views, shown, screen_pose(PHONE), phone=PHONE)
    off = between(mount.T_phone_object, screen_pose(PHONE).T_phone_screen @ T_screen_object)
    assert np.linalg.norm(off[3:]) < 0.002
    assert np.linalg.norm(off[:3]) < 0.005
    other = [Photo("unknown.png", np.zeros((1440, 1920), np.uint8))]
    for pictures, where, code in [
        (other, model, "model-images"),
        (photos(tmp_path), tmp_path / "none", "model-unreadable"),
        (
            photos(tmp_path),
            _model(tmp_path / "f", T_camera_model, "OPENCV_FISHEYE"),
            "model-camera",
        ),
    ]:
        with pytest.raises(InputError) as caught:
            views_in_model(pictures, shown, where)
        assert caught.value.code == code
