"""The camera of a film is found where it was: people are drawn within two pixels of the truth."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.commands.overlay import OverlayRequest
from capture_app.overlay.aligned import eye_of, mount_of, own_film, session_of
from capture_app.overlay.find_camera import find
from capture_app.overlay.placing import (
    FilmPlacement,
    arkit_world,
    board_in_room,
    by_board_in_room,
    by_board_on_object,
)
from ingest.calibration.board.board_lens import distorted
from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_spec import PRESETS
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS
from render.cameras import Camera
from render.overlay import pixels_of
from tests.simulator.witness import board_on_box, corner_observations, record_witness

# `watched` is what conftest.py makes: a motion, a person, a witness and its track of the board.
Watched = Any
BOARD = PRESETS["A4"]
PLACE = board_on_box(BOARD)


def pixels_off(watched: Watched, place: FilmPlacement) -> float:
    """Pixels between the person's joints through the camera that was found and the true one.

    The clocks count too: the joints are those that ride with the box, as far as hands are from it.
    """
    witness = watched.witness
    film = witness.times(watched.motion)
    lens = witness.camera.lens
    offsets = np.random.default_rng(0).uniform(-0.8, 0.8, (24, 3)) * [0.4, 1, 1]
    worst = 0.0
    for time in film[:: len(film) // 12]:
        seen = []
        for T, seconds in (
            (witness.T_world_camera, time + witness.start),
            (place.T_world_rest, time + place.offset),
        ):
            camera = Camera(
                T @ T_OPENCV_ARKIT_CAMERA,
                witness.camera.fx,
                witness.camera.fy,
                witness.camera.cx,
                witness.camera.cy,
            )
            at = np.clip(seconds * FPS, 0, len(watched.motion.valid) - 1)
            middle = np.array(
                [
                    np.interp(at, np.arange(len(watched.motion.valid)), axis)
                    for axis in watched.motion.T_world_object[:, :3, 3].T
                ]
            )
            seen.append(pixels_of(middle + offsets, camera, lambda rays: distorted(rays, lens)))
        inside = (np.abs(seen[0][:, :2] - [640, 360]) < [640, 360]).all(axis=1)
        worst = max(worst, float(np.linalg.norm((seen[0] - seen[1])[inside, :2], axis=1).max()))
    return worst


@pytest.mark.parametrize("known", [None, PLACE], ids=["place unknown", "place known"])
def test_a_board_on_the_object_tells_camera_and_clock(watched: Watched, known: Any) -> None:
    place = by_board_on_object(watched.motion, watched.track(), known, None)
    assert place.offset == pytest.approx(watched.witness.start, abs=0.005)
    assert pixels_off(watched, place) < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False], ids=["camera known", "camera unknown"])
def test_a_film_of_the_board_alone_tells_camera_and_clock(
    watched: Watched, result: Any, tmp_path: Path, known: bool
) -> None:
    """The way of `omocap overlay --video witness.mp4 --board A4`, from drawn pictures."""
    small = replace(watched.witness, camera=watched.witness.camera.at(960, 540), rate=6.0)
    record_witness(tmp_path / "witness.mp4", watched.motion, BOARD, PLACE, small)
    camera = tmp_path / "camera.json" if known else None
    said = OverlayRequest(
        result=result.folder,
        output=tmp_path / "film.mp4",
        video=tmp_path / "witness.mp4",
        camera=camera,
        board="A4",
    )
    aligned = find(result, said, lambda name, done: None)
    assert aligned.seconds[0] == pytest.approx(small.start, abs=0.01)
    middle = watched.motion.T_world_object[:, :3, 3].mean(axis=0)
    points = middle + np.random.default_rng(0).uniform(-0.4, 0.4, (40, 3))
    lens = small.camera.lens
    pinhole = small.camera.fx, small.camera.fy, small.camera.cx, small.camera.cy
    true = Camera(small.T_world_camera @ T_OPENCV_ARKIT_CAMERA, *pinhole)
    truth = pixels_of(points, true, lambda rays: distorted(rays, lens))
    found = pixels_of(points, aligned.cameras[0], aligned.distort)
    # Beyond the picture and in corners that the board never reached, nothing tells the distortion.
    assert np.quantile(np.linalg.norm((found - truth)[:, :2], axis=1), 0.9) < 2.0


def test_a_given_offset_is_used(watched: Watched) -> None:
    place = by_board_on_object(watched.motion, watched.track(), PLACE, watched.witness.start)
    assert place.offset == watched.witness.start
    assert pixels_off(watched, place) < 2.0
    with pytest.raises(InputError) as refused:
        by_board_on_object(watched.motion, watched.track(), PLACE, 99.0)
    assert refused.value.code == "overlay-no-overlap"


def lying() -> np.ndarray:
    """T_world_board of a board that lies on a table, its print up."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("x", 180, degrees=True).as_matrix()
    T[:3, 3] = [-0.1, -0.2, 0.7]
    return T


def test_a_board_in_the_room_tells_the_camera(watched: Watched) -> None:
    witness, T_world_board = watched.witness, lying()
    rng = np.random.default_rng(1)
    seen = np.tile(inverse(witness.T_world_camera) @ T_world_board, (40, 1, 1))
    big = replace(BOARD, square=2 * BOARD.square, marker=2 * BOARD.marker)
    pixels, numbers = corner_observations(seen, big, witness.camera, rng, sigma=0.3)
    poses = board_poses(pixels, numbers, big, witness.camera.K, witness.camera.lens)
    sure = ~poses.ambiguous
    place = FilmPlacement(
        by_board_in_room(T_world_board, poses.T_camera_board[sure]), witness.start
    )
    assert pixels_off(watched, place) < 2.0


def test_the_phone_tells_where_a_board_in_the_room_lies(
    watched: Watched, phone_result: Any
) -> None:
    """Seen in the phone's own world, it comes out in the result's."""
    session, mount = session_of(phone_result), mount_of(phone_result)
    T_world_arkit = arkit_world(phone_result.object_motion, session, mount)
    T_world_phone = watched.motion.T_world_object[0] @ inverse(mount.T_phone_object)
    again = T_world_arkit @ session.T_world_phone[0]
    assert np.abs(again[:3, 3] - T_world_phone[:3, 3]).max() < 0.01
    T_arkit_board = np.tile(inverse(T_world_arkit) @ lying(), (5, 1, 1))
    T_arkit_board[2, :3, 3] += 0.4  # a wild one
    np.testing.assert_allclose(board_in_room(T_world_arkit, T_arkit_board), lying(), atol=1e-6)


def test_the_phones_own_film_shows_the_object_at_rest(watched: Watched, phone_result: Any) -> None:
    aligned = own_film(phone_result)
    assert len(aligned.seconds) == len(aligned.cameras) > 50
    corner = np.append(watched.motion.mesh.vertices[0], 1.0)
    pixels = []
    for k in (0, 10, 20, 30, 40, 50):
        at = aligned.seconds[k] * FPS
        if abs(at - round(at)) < 1e-6:
            world = watched.motion.T_world_object[round(at)] @ corner
            pixels.append(aligned.cameras[k].project(world[:3]))
    assert len(pixels) >= 2
    # Autofocus breathes; the box is clamped to the phone and stays where it is.
    assert np.ptp(np.array(pixels), axis=0).max() < 1.0
    eye = eye_of(phone_result)
    assert eye is not None
    np.testing.assert_allclose(
        aligned.cameras[0].T_world_camera,
        watched.motion.T_world_object[0] @ eye.T_object_camera,
        atol=1e-9,
    )


def test_a_film_of_another_time_is_refused(phone_result: Any) -> None:
    with pytest.raises(InputError, match="lasts from"):
        own_film(phone_result, offset=500.0)


def test_an_object_without_a_phone_has_no_film_of_its_own(result: Any) -> None:
    assert eye_of(result) is None
    with pytest.raises(InputError) as refused:
        own_film(result)
    assert refused.value.code == "overlay-no-phone"
