"""The guide through recordings: boards, scans and trackers, of simulated phones."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import clamped_phone, write_recording
from capture_app.simulator.simulated_phone import simulate
from ingest.mount_file import load_mount
from ingest.uncertainty import between, bounds_95
from tests.capture_app.calibrate.guided import (
    BOARD,
    BY_BOARD,
    BY_DRAWING,
    BY_SESSION,
    BY_TRACKER,
    drawn,
    numbers,
    off,
)
from tests.ingest.calibration.board.filmed import picture, write_film
from tests.simulator.scan_log import scan_log
from tests.simulator.scan_scene import ScanScene, scan_scene
from tests.simulator.wiggle import Wiggle, wiggle_motion
from tests.simulator.witness import board_on_box, save_camera, tripod


def write_wiggle(folder: Path, kind: Wiggle, seconds: float = 12.0) -> None:
    """The session of a phone on a box that is turned about so."""
    session = simulate(wiggle_motion(kind, seconds=seconds, seed=3), clamped_phone(), seed=1)
    write_recording(session, folder)


def board_answers() -> list[str]:
    """The four outer corners of the board on the box."""
    T, w, h = board_on_box(BOARD), BOARD.width, BOARD.height
    places = np.array([[0, 0, 0, 1], [w, 0, 0, 1], [w, h, 0, 1], [0, h, 0, 1]]) @ T.T
    return [numbers(place[:3]) for place in places]


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a second camera saw of the board in the motion of `write_wiggle`."""
    motion = wiggle_motion("all axes", seconds=12.0, seed=3)
    witness = tripod(distance=0.8, size=(640, 480), rate=4.0)
    T = witness.board_poses(motion, board_on_box(BOARD))
    stamps = [round(1000 * time) for time in witness.times(motion)]
    path = tmp_path_factory.mktemp("witness") / "film.mp4"
    save_camera(witness.camera, path.with_name("camera.json"))
    return write_film(path, [picture(pose, BOARD, witness.camera) for pose in T], stamps)


@pytest.mark.runs("calibrate board")
def test_a_board_by_answers(converse, tmp_path: Path, film: Path):
    write_wiggle(tmp_path / "still", "tiny")
    write_wiggle(tmp_path / "take", "all axes")
    first, *others = board_answers()
    told = converse(
        *(BY_BOARD, "mount.json", "box.obj", "A4", "y", ""),
        *("0.1 0.2 0.3 0.4", first, *others),
        *("nothing", "still", "take"),
        *("take", f"'{film}'", "missing.json", str(film.with_name("camera.json")), "y", ""),
    )
    assert told.code == 0, told.err
    mount = load_mount(tmp_path / "mount.json")
    assert mount.covariance is not None
    bounds = bounds_95(mount.covariance)
    assert off(mount, clamped_phone()) < (bounds.mm, bounds.deg)
    assert bounds.mm < 15
    assert (tmp_path / "board.pdf").exists()
    for hint in (
        "'0.1 0.2 0.3 0.4' is not 3 numbers",
        "4 points, which fit the board within 0.0 mm",
        "There is no such file or folder",
        "The phone turned by",
        "60 poses a second, 12 s, tracked without a break, turned by up to",
        "about a second direction",
        "The session holds no video",
        "of 24 pictures at its beginning",
        "There is no camera file",
        "The object never stands still on the floor",
    ):
        assert hint in told.out
    assert told.commands[0][0] == "board"


def test_a_board_that_was_printed_too_small_is_named_as_it_is(converse):
    told = converse(BY_BOARD, "mount.json", "box.obj", "a4", "n", "150 100", "A4", "n", "150 148.5")
    assert "was printed on another paper" in told.out
    assert "--board 5x7:34.65mm:25.74mm:DICT_5X5_100" in told.err


@pytest.mark.parametrize(
    ("move", "doubt"),
    [
        (lambda points: points + np.array([0.2, 0, 0]), "cm from the mesh's surface"),
        (lambda points: points[[1, 0, 3, 2]], "would face into the object"),
    ],
    ids=["elsewhere", "seen from behind"],
)
def test_a_place_of_the_board_that_is_doubtful(converse, tmp_path: Path, move, doubt: str):
    points = np.array([[float(x) for x in text.split()] for text in board_answers()])
    moved = [numbers(point) for point in move(points)]
    answers = (BY_BOARD, "mount.json", "box.obj", "A4", "n", "")
    told = converse(*answers, *moved, "n", *board_answers())
    assert doubt in told.out
    assert "Once more, then." in told.out
    assert "--board-place board-place.json RECORDING FILM" in told.err
    file = json.loads((tmp_path / "board-place.json").read_text())
    np.testing.assert_allclose([p["object"] for p in file["points"]], points)


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ScanScene]:
    """One recording in which a chair is filmed and the phone is clamped to it, and its scan."""
    folder = tmp_path_factory.mktemp("scanned")
    scene = scan_scene(4)
    log, T_arkit_world = scan_log(scene, seed=4)
    write_recording(log, folder / "take")
    mesh_file = trimesh.Trimesh(scene.mesh.vertices, scene.mesh.faces, process=False)
    mesh_file.export(folder / "chair.obj")
    mesh_file.apply_transform(T_arkit_world @ scene.T_world_object)
    mesh_file.export(folder / "scan.obj")
    return folder, scene


def test_one_recording_and_its_scan(converse, tmp_path: Path, scanned: tuple[Path, ScanScene]):
    folder, scene = scanned
    write_wiggle(tmp_path / "held", "all axes")
    told = converse(
        *(BY_SESSION, "mount.json", str(folder / "chair.obj")),
        *("held", str(folder / "take"), str(folder / "scan.obj"), "y", "n"),
    )
    assert told.code == 0, told.err
    mount = load_mount(tmp_path / "mount.json")
    assert mount.covariance is not None
    step = between(mount.T_phone_object, scene.mount.T_phone_object)
    assert step @ np.linalg.solve(mount.covariance, step) < 16.8
    assert "The phone never stands still for 1 s after it was carried about" in told.out
    assert "the clamped phone rests from 14.9 to 17.6 s and again from 21.4 to 24.0 s" in told.out
    assert "rests on the floor 2 times" in told.out


@pytest.mark.runs("calibrate combine")
def test_what_disagrees_is_done_again(converse, tmp_path: Path, scanned: tuple[Path, ScanScene]):
    folder, scene = scanned
    model, point, xyz, axes, precision = drawn(scene.mount)
    x, y, z = (float(value) for value in xyz.split())
    wrong = numbers([x, y + 0.2, z])
    told = converse(
        *(f"{BY_DRAWING} {BY_SESSION}", "mount.json", str(folder / "chair.obj")),
        *(model, point, wrong, axes, precision, "y"),
        *(str(folder / "take"), str(folder / "scan.obj"), "y"),
        *("1", "3", point, xyz, "y", "n"),
    )
    assert told.code == 0, told.err
    assert "disagree beyond what they claim" in told.out
    assert told.commands[-1][:3] == ["combine", "mount-drawing-2.json", "mount-session.json"]
    names = {path.name for path in tmp_path.glob("mount*.json")}
    assert names == {
        "mount-drawing.json", "mount-drawing-2.json", "mount-session.json", "mount.json"
    }  # fmt: skip
    found = load_mount(tmp_path / "mount.json")
    assert off(found, scene.mount) < (15, 1.5)


def test_a_tracker_of_a_pushed_box_and_what_stays_open(converse, tmp_path: Path):
    """Pushed over the floor the height is open; it is told before anything is computed, and after."""
    motion = wiggle_motion("yaw", seconds=20.0, seed=3)
    write_recording(simulate(motion, clamped_phone(), seed=1), tmp_path / "take")
    T = motion.T_world_object[::2]
    columns = [np.arange(len(T)) / 15, *T[:, :3, 3].T]
    columns += list(Rotation.from_matrix(T[:, :3, :3]).as_quat().T)
    np.savetxt(tmp_path / "poses.txt", np.stack(columns, axis=1), "%.6f")
    (tmp_path / "few.txt").write_text("0 0 0 0 0 0 0 1\n")
    told = converse(
        *(BY_TRACKER, "mount.json", "box.obj", "take", "n", "take", "y"),
        *("few.txt", "poses.txt", "missing.txt", "", "y", ""),
    )
    assert told.code == 0, told.err
    assert told.out.count("It turned about one direction only") == 2
    assert "The file has no two poses" in told.out
    assert "There is no such file of a pose" in told.out
    assert "Is that where the phone is, but for what was not seen?" in told.out
    assert "Still open: the height of the object" in told.out
    assert "omocap calibrate combine mount.json OTHER.json" in told.out
