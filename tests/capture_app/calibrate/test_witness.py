"""The simulated witness: what it films is where it says; and the motions it is shown."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.calibration.board.board_detect import Detector
from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_spec import PRESETS
from ingest.calibration.board.board_track import track_video
from ingest.calibration.board.camera_file import load_camera
from ingest.uncertainty import between
from omomo_core.motion import FPS
from tests.simulator.wiggle import wiggle_motion
from tests.simulator.witness import (
    board_on_box,
    corner_observations,
    film,
    object_poses,
    record_witness,
    tripod,
)

BOARD = PRESETS["A4"]
PLACE = board_on_box(BOARD)


LENS = (0.1, -0.15, 0.001, -0.001, 0.0)


def test_pictures_show_the_board_where_it_is():
    motion = wiggle_motion("all axes", seconds=3.0, seed=3)
    witness = tripod(distance=0.7, size=(480, 360), distortion=LENS, rate=1.0, start=0.97)
    found = [
        Detector(BOARD).find(np.ascontiguousarray(rgb[..., 1]))
        for rgb in film(motion, BOARD, PLACE, witness)
    ]
    camera = witness.camera
    pixels, numbers = [f.pixels for f in found], [f.numbers for f in found]
    poses = board_poses(pixels, numbers, BOARD, camera.K, camera.lens)
    assert len(poses.frames) >= 2
    assert poses.rms.max() < 0.25
    truth = witness.board_poses(motion, PLACE)[poses.frames]
    step = between(poses.T_camera_board, truth)
    # Along and across the view differ by a factor of ten: each by its own sigma.
    assert np.abs(step / np.sqrt(np.diagonal(poses.covariance, axis1=1, axis2=2))).max() < 4
    assert np.abs(step[:, 3:]).max() < 10e-3


@pytest.mark.slow
@pytest.mark.parametrize("lens", [(), LENS])
def test_a_film_gives_the_boards_path(tmp_path: Path, lens):
    motion = wiggle_motion("all axes", seconds=6.0, seed=3)
    witness = tripod(distance=0.75, size=(640, 480), distortion=lens, rate=3.0, start=0.37)
    count = record_witness(tmp_path / "witness.mp4", motion, BOARD, PLACE, witness)
    times = witness.times(motion)
    assert count == len(times)
    track = track_video(tmp_path / "witness.mp4", BOARD, load_camera(tmp_path / "camera.json"))
    index = np.rint(track.times * 3.0).astype(int)
    np.testing.assert_allclose(track.times, times[index], atol=1e-3)
    step = between(track.T_camera_board, witness.board_poses(motion, PLACE)[index])
    assert np.median(np.abs(step[:, 3:])) < 0.5e-3
    assert np.degrees(np.median(np.linalg.norm(step[:, :3], axis=1))) < 0.2
    assert track.sigma < 0.2


def test_observations_without_drawing_err_as_asked():
    motion = wiggle_motion("all axes", seconds=20.0, seed=1)
    witness = tripod(distance=1.2)
    T = witness.board_poses(motion, PLACE)
    exact = corner_observations(T, BOARD, witness.camera, np.random.default_rng(0), sigma=0.0)
    noisy = corner_observations(
        T, BOARD, witness.camera, np.random.default_rng(0), sigma=0.5, lost=0.2, wild=0.1
    )
    assert sum(map(len, noisy[1])) / sum(map(len, exact[1])) == pytest.approx(0.8, abs=0.03)
    off = []
    for k in range(len(T)):
        there = np.isin(noisy[1][k], exact[1][k])
        same = np.searchsorted(exact[1][k], noisy[1][k][there])
        off.append(noisy[0][k][there] - exact[0][k][same])
    off = np.concatenate(off)
    far = np.linalg.norm(off, axis=1)
    assert (far > 3).mean() == pytest.approx(0.1, abs=0.02)
    assert off[far < 3].std() == pytest.approx(0.5, rel=0.1)


def test_nothing_is_seen_from_behind_or_outside():
    motion = wiggle_motion("translation", seconds=2.0)
    witness = tripod()
    T = witness.board_poses(motion, PLACE)
    behind = T.copy()
    behind[:, :3, :3] = T[:, :3, :3] @ Rotation.from_euler("x", np.pi).as_matrix()
    aside = T.copy()
    aside[:, 0, 3] += 5.0
    for poses in (behind, aside):
        _, numbers = corner_observations(poses, BOARD, witness.camera, np.random.default_rng(0))
        assert sum(map(len, numbers)) == 0


def test_the_witness_moves_between_the_objects_frames():
    motion = wiggle_motion("all axes", seconds=3.0)
    np.testing.assert_allclose(
        object_poses(motion, np.arange(90) / FPS), motion.T_world_object, atol=1e-9
    )
    between_frames = object_poses(motion, np.array([40.5 / FPS]))[0, :3, 3]
    middle = motion.T_world_object[40:42, :3, 3].mean(axis=0)
    np.testing.assert_allclose(between_frames, middle, atol=1e-3)


def turned(kind) -> np.ndarray:
    """Rotation vectors from the first pose, degrees."""
    R = wiggle_motion(kind, seconds=20.0, seed=2).T_world_object[:, :3, :3]
    return np.degrees(Rotation.from_matrix(R @ R[0].T).as_rotvec())


def test_kinds_of_motion():
    spread = np.linalg.svd(turned("all axes"), compute_uv=False) / np.sqrt(600)
    assert spread.min() > 5
    yaw = turned("yaw")
    assert np.abs(yaw[:, :2]).max() < 1e-6
    assert np.abs(yaw[:, 2]).max() > 40
    assert np.abs(turned("translation")).max() < 1e-6
    assert 1 < np.linalg.norm(turned("tiny"), axis=1).max() < 4


def test_pushing_stays_on_the_floor_and_all_start_at_rest():
    for kind in ("all axes", "yaw", "translation", "tiny"):
        motion = wiggle_motion(kind, seconds=5.0)
        speed = np.linalg.norm(np.diff(motion.T_world_object[:, :3, 3], axis=0), axis=1)
        assert speed[[0, -1]].max() < 1e-3 < speed.max()
    pushed = wiggle_motion("yaw", seconds=5.0)
    lowest = (pushed.mesh.vertices @ pushed.T_world_object[50, :3, :3].T)[:, 2].min()
    assert lowest + pushed.T_world_object[50, 2, 3] == pytest.approx(0.0, abs=1e-9)
