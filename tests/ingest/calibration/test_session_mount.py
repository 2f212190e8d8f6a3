"""Method session: the object scanned and the phone clamped in one ARKit session."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_app.simulator.simulated_phone import NO_NOISE
from ingest.calibration.board.board_place import BoardPlace
from ingest.calibration.board.board_spec import Board
from ingest.calibration.board.board_track import BoardTrack
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.calibration.session_align import register
from ingest.calibration.session_mount import (
    load_scan,
    placed_by_board,
    placed_by_hand,
    placed_by_scan,
    session_mount,
)
from ingest.calibration.still import DRIFT, MAP_ERROR, clamped_stills, named_stills, walked
from ingest.mesh import load_mesh
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.uncertainty import between, bounds_95, moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh
from tests.ingest.calibration.scanned import scanned, upright
from tests.simulator.scan_log import STILLS, scan_log
from tests.simulator.scan_scene import ScanScene, scan_scene

T_OPENCV_PHONE = np.diag([1.0, -1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def scene() -> ScanScene:
    return scan_scene(2)


def _placed_mesh(mesh: ObjectMesh, T: np.ndarray) -> ObjectMesh:
    return replace(mesh, vertices=mesh.vertices @ T[:3, :3].T + T[:3, 3])


def _surprise(found: Mount, truth: Mount) -> float:
    """Squared distance between the two in units of the covariance."""
    assert found.covariance is not None
    step = between(found.T_phone_object, truth.T_phone_object)
    return float(step @ np.linalg.solve(found.covariance, step))


def _calibrated(scene: ScanScene, log: CaptureSession, scan: ObjectMesh) -> Mount:
    stills, _ = clamped_stills(log, path=1.0)
    placed = placed_by_scan(log, scene.mesh, scan, stills[0].start, "scan.ply")
    return session_mount(log, scene.mesh, placed, stills)


@settings(max_examples=10)
@given(seed=st.integers(0, 10_000))
def test_a_perfect_phone_gives_the_mount_exactly(seed: int):
    scene = scan_scene(seed)
    log, T_arkit_world = scan_log(scene, seed=seed, noise=NO_NOISE)
    found = _calibrated(scene, log, _placed_mesh(scene.mesh, T_arkit_world @ scene.T_world_object))
    np.testing.assert_allclose(found.T_phone_object, scene.mount.T_phone_object, atol=1e-9)
    assert found.method == "session"


@pytest.mark.parametrize("drift", [0.0, DRIFT], ids=["steady", "drifting"])
def test_the_truth_is_within_the_bounds(drift: float):
    surprises = []
    for seed in range(20):
        scene = scan_scene(seed)
        log, T_arkit_world = scan_log(scene, seed=seed)
        rng = np.random.default_rng(seed)
        # The scan is in the world as it was when the phone looked at the object last.
        seconds = log.times - log.times[0]
        path = np.array([walked(log, 13.0, float(t)) for t in seconds])
        T_drifted = log.T_world_phone.copy()
        T_drifted[:, :3, 3] += path[:, None] * rng.normal(0, drift / np.sqrt(8 / np.pi), 3)
        log = replace(log, T_world_phone=T_drifted)
        errors = rng.normal(size=6) * np.sqrt(np.diag(MAP_ERROR))
        T = moved(T_arkit_world @ scene.T_world_object, errors)
        surprises.append(
            _surprise(_calibrated(scene, log, _placed_mesh(scene.mesh, T)), scene.mount)
        )
    # 95 % of chi-squared with 6 degrees of freedom; its mean is 6.
    assert np.mean(np.array(surprises) < 12.6) >= 0.9
    assert np.mean(surprises) > 1.0


def test_an_end_that_drifted_counts_less(scene: ScanScene):
    drifted = moved(scene.T_world_clamped, np.array([0, 0, 0, 0.02, 0, 0]))
    log, T_arkit_world = scan_log(scene, seed=2, end=drifted)
    mesh = _placed_mesh(scene.mesh, T_arkit_world @ scene.T_world_object)
    found = _calibrated(scene, log, mesh)
    off = np.linalg.norm(found.T_phone_object[:3, 3] - scene.mount.T_phone_object[:3, 3])
    assert 0.0005 < off < 0.01
    assert found.residuals["stills_mm"] > 5


def test_a_noisy_scan_in_which_the_object_has_another_frame(scene: ScanScene):
    log, T_arkit_world = scan_log(scene, seed=2)
    scan = scanned(scene.mesh, T_arkit_world @ scene.T_world_object, 2)
    T_own = np.eye(4)
    T_own[:3, :3] = Rotation.from_euler("xyz", [2.1, -0.7, 1.2]).as_matrix()
    T_own[:3, 3] = [0.2, -0.1, 0.3]
    own = replace(scene, mesh=_placed_mesh(scene.mesh, T_own))
    found = _calibrated(own, log, scan)
    truth = Mount(scene.mount.T_phone_object @ inverse(T_own), "truth")
    assert _surprise(found, truth) < 16.8
    assert bounds_95(found.covariance).mm < 25 if found.covariance is not None else False
    assert 2 < found.residuals["scan_mm"] < 6


@pytest.mark.slow
def test_alignments_lie_within_their_bounds(scene: ScanScene):
    surprises = []
    for seed in range(20):
        T = upright(seed)
        found = register(scene.mesh, scanned(scene.mesh, T, seed), "scan")
        step = between(found.T_scan_object, T)
        surprises.append(step @ np.linalg.solve(found.covariance, step))
    assert np.mean(np.array(surprises) < 12.6) >= 0.9
    assert np.mean(surprises) > 1.0


@pytest.mark.parametrize(
    ("shape", "code"),
    [
        (trimesh.creation.box((0.34, 0.44, 0.30)), "scan-symmetric"),
        (trimesh.creation.cylinder(0.15, 0.5), "scan-symmetric"),
        (trimesh.creation.box((0.5, 0.4, 0.01)), "scan-slides"),
    ],
    ids=["box", "bucket", "plate"],
)
def test_a_shape_that_does_not_tell_how_it_stands(shape: trimesh.Trimesh, code: str):
    mesh = ObjectMesh(np.asarray(shape.vertices), np.asarray(shape.faces), "shape")
    with pytest.raises(InputError) as caught:
        register(mesh, scanned(mesh, upright(1), 1), "scan.ply")
    assert caught.value.code == code
    assert "‹object_pose›" in caught.value.fix


def test_the_same_vertices_are_aligned_even_if_symmetric():
    box = trimesh.creation.box((0.34, 0.44, 0.30))
    mesh = ObjectMesh(np.asarray(box.vertices), np.asarray(box.faces), "box")
    found = register(mesh, _placed_mesh(mesh, upright(4)), "scan.ply")
    np.testing.assert_allclose(found.T_scan_object, upright(4), atol=1e-12)


def test_another_object(scene: ScanScene):
    cupboard = trimesh.creation.box((0.5, 0.3, 0.9))
    mesh = ObjectMesh(np.asarray(cupboard.vertices), np.asarray(cupboard.faces), "cupboard")
    with pytest.raises(InputError) as caught:
        register(mesh, scanned(scene.mesh, upright(5), 5), "scan.ply")
    assert caught.value.code == "scan-overlap"


def _refused(scene: ScanScene, log: CaptureSession, T_world_object: np.ndarray) -> InputError:
    with pytest.raises(InputError) as caught:
        _calibrated(scene, log, _placed_mesh(scene.mesh, T_world_object))
    return caught.value


def test_a_scan_in_another_world(scene: ScanScene):
    log, T_arkit_world = scan_log(scene, seed=2)
    zup = np.eye(4)
    zup[:3, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    zup[:3, 3] = [2, 0, 3]
    assert _refused(scene, log, zup @ T_arkit_world @ scene.T_world_object).code == "scan-elsewhere"


def test_tracking_that_broke_while_the_phone_was_clamped(scene: ScanScene):
    log, T_arkit_world = scan_log(scene, seed=2)
    T = log.T_world_phone.copy()
    T[log.times - log.times[0] > 14.0, :3, 3] += [0.1, 0, 0]
    error = _refused(scene, replace(log, T_world_phone=T), T_arkit_world @ scene.T_world_object)
    assert error.code == "session-broken"
    assert "14.0 s" in error.what


def test_a_phone_that_slipped(scene: ScanScene):
    turned = scene.T_world_clamped.copy()
    turned[:3, :3] = turned[:3, :3] @ Rotation.from_euler("x", 5, degrees=True).as_matrix()
    log, T_arkit_world = scan_log(scene, seed=2, end=turned)
    error = _refused(scene, log, T_arkit_world @ scene.T_world_object)
    assert error.code == "session-slipped"
    assert "21." in error.what
    assert "14." in error.what
    assert "5.0 deg" in error.what
    # With the first rest alone nothing tells.
    stills = named_stills(log, [STILLS[0]])
    T = T_arkit_world @ scene.T_world_object
    placed = placed_by_hand(log, scene.mesh, T, stills[0].start, "pose.txt")
    found = session_mount(log, scene.mesh, placed, stills)
    assert _surprise(found, scene.mount) < 12.6


def test_a_phone_deep_inside_the_object(scene: ScanScene):
    log, T_arkit_world = scan_log(scene, seed=2)
    cupboard = trimesh.creation.box((1.2, 1.2, 1.9))
    mesh = ObjectMesh(np.asarray(cupboard.vertices), np.asarray(cupboard.faces), "cupboard")
    T = T_arkit_world @ scene.T_world_object
    stills, _ = clamped_stills(log, path=1.0)
    with pytest.raises(InputError) as caught:
        session_mount(log, mesh, placed_by_hand(log, mesh, T, stills[0].start, "pose.txt"), stills)
    assert caught.value.code == "session-place"
    assert "inside" in caught.value.what


def test_a_scan_is_read_in_the_axes_of_the_session(tmp_path: Path, scene: ScanScene):
    mesh = _placed_mesh(scene.mesh, upright(0))
    for name in ("scan.obj", "scan.glb"):
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(tmp_path / name)
        back = load_scan(tmp_path / name)
        found = register(load_mesh(tmp_path / "scan.obj"), back, name)
        np.testing.assert_allclose(found.T_scan_object, np.eye(4), atol=1e-6)
    T = upright(3)
    (tmp_path / "mesh_info.json").write_text(
        json.dumps({"alignmentTransform": T.T.ravel().tolist()})
    )
    back = load_scan(tmp_path / "scan.obj")
    found = register(load_mesh(tmp_path / "scan.obj"), back, "scan.obj")
    np.testing.assert_allclose(found.T_scan_object, inverse(T), atol=1e-6)
    (tmp_path / "mesh_info.json").write_text("{}")
    with pytest.raises(InputError) as caught:
        load_scan(tmp_path / "scan.obj")
    assert caught.value.code == "scan-damaged"


def _track(log: CaptureSession, T_world_board: np.ndarray, seed: int, start: float) -> BoardTrack:
    """The board as the session's own pictures show it, three times a second."""
    rng = np.random.default_rng(seed)
    chosen = np.arange(len(log.times))[int(start * 30) :: 10]
    camera = log.T_world_phone[chosen] @ T_OPENCV_PHONE
    sd = np.array([0.002] * 3 + [0.001] * 3)
    steps = rng.normal(size=(len(chosen), 6)) * sd
    return BoardTrack(
        times=log.times[chosen],
        T_camera_board=moved(inverse(camera) @ T_world_board, steps),
        covariance=np.tile(np.diag(sd**2), (len(chosen), 1, 1)),
        rms=np.full(len(chosen), 0.3),
        corners=np.full(len(chosen), 24),
        pixels=[],
        numbers=[],
        board=Board(5, 7, 0.035, 0.026),
        camera=WitnessCamera(487.0, 487.0, 319.5, 239.5),
        sigma=0.3,
        pictures=len(chosen),
        T_world_camera=camera,
    )


def test_a_board_on_the_object_says_where_it_stood():
    surprises = []
    for seed in range(12):
        scene = scan_scene(seed)
        log, T_arkit_world = scan_log(scene, seed=seed)
        rng = np.random.default_rng(seed)
        T_object_board = upright(seed)
        covariance = np.diag([0.005] * 3 + [0.002] * 3) ** 2
        off = rng.normal(size=6) * np.sqrt(np.diag(covariance))
        place = BoardPlace(moved(T_object_board, off), covariance, 0.001)
        T_world_board = T_arkit_world @ scene.T_world_object @ T_object_board
        stills, _ = clamped_stills(log, path=1.0)
        placed = placed_by_board(log, _track(log, T_world_board, seed, 0.0), place, stills[0].start)
        found = session_mount(log, scene.mesh, placed, stills)
        surprises.append(_surprise(found, scene.mount))
    # The simulated map has no error of its own, which the bounds allow for.
    assert np.mean(np.array(surprises) < 12.6) >= 0.9
    assert np.mean(surprises) > 0.5


def test_a_board_seen_only_after_the_clamping(scene: ScanScene):
    log, T_arkit_world = scan_log(scene, seed=2)
    place = BoardPlace(np.eye(4), 1e-6 * np.eye(6), 0.0)
    track = _track(log, T_arkit_world @ scene.T_world_object, 2, 18.0)
    with pytest.raises(InputError) as caught:
        placed_by_board(log, track, place, STILLS[0][0])
    assert caught.value.code == "board-few"
