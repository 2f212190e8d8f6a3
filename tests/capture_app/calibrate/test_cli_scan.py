"""`omocap calibrate scan` and `omocap calibrate session`, as they are typed."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import trimesh
import typer

from capture_app.cli.calibrate import scan, session
from ingest.formats import scanner_3d
from ingest.mount_file import load_mount
from ingest.uncertainty import between
from omomo_core.errors import InputError
from tests.log_writers import write_session
from tests.simulator.scan_log import STILLS, scan_log, with_pictures
from tests.simulator.scan_model import SimulatedModel, drawn_model
from tests.simulator.scan_scene import ScanScene, orbit_poses, scan_scene

app = typer.Typer()
app.command()(scan)
app.command()(session)


@dataclass(frozen=True)
class Desk:
    """The files that a user has."""

    scene: ScanScene
    model: SimulatedModel
    folder: Path
    T_arkit_world: np.ndarray

    def run(self, *words: object) -> None:
        app([str(word) for word in words], standalone_mode=False)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Desk:
    folder = tmp_path_factory.mktemp("desk")
    scene = scan_scene(4)
    model = drawn_model(scene, orbit_poses(scene, 8), folder, seed=4)
    log, T_arkit_world = scan_log(scene, seed=4)
    filmed = with_pictures(log, scene, folder / "film", (16.0, 17.0, 22.5, 23.5))
    write_session(scanner_3d, filmed, folder / "take")
    mesh_file = trimesh.Trimesh(scene.mesh.vertices, scene.mesh.faces, process=False)
    mesh_file.export(folder / "chair.obj")
    mesh_file.apply_transform(T_arkit_world @ scene.T_world_object)
    mesh_file.export(folder / "scan.obj")
    np.savetxt(folder / "to_object.txt", model.T_object_model)
    np.savetxt(folder / "pose.txt", T_arkit_world @ scene.T_world_object)
    return Desk(scene, model, folder, T_arkit_world)


def _check(desk: Desk, mount_file: Path, method: str) -> None:
    mount = load_mount(mount_file)
    assert mount.method == method
    assert mount.object_id.startswith("chair")
    assert mount.covariance is not None
    step = between(mount.T_phone_object, desk.scene.mount.T_phone_object)
    assert step @ np.linalg.solve(mount.covariance, step) < 16.8
    assert np.linalg.norm(step[3:]) < 0.02


@pytest.mark.runs("calibrate scan")
def test_scan(desk: Desk, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    output = tmp_path / "mount.json"
    common = [desk.model.sparse, "--images", desk.model.images, "--object"]
    common += [desk.folder / "chair.obj", "--model-to-object", desk.folder / "to_object.txt"]
    start, stop = STILLS[0]
    still = ["--still", f"{start + 0.3}:{stop - 0.3}"]
    desk.run("scan", *common, "--session", desk.folder / "take", *still, "-o", output)
    _check(desk, output, "scan")
    assert "What was recognised is found again to" in " ".join(capsys.readouterr().out.split())
    with pytest.raises(InputError) as caught:
        desk.run("scan", *common, "-o", tmp_path / "other.json")
    assert caught.value.code == "scan-ways"
    with pytest.raises(InputError) as caught:
        desk.run("scan", *common, "--photos", desk.folder / "film", "-o", tmp_path / "other.json")
    assert caught.value.code == "intrinsics-unreadable"


@pytest.mark.parametrize("way", [["--scan", "scan.obj"], ["--object-pose", "pose.txt"]])
@pytest.mark.runs("calibrate session")
def test_session(desk: Desk, tmp_path: Path, way: list[str]):
    output = tmp_path / "mount.json"
    words = ["session", desk.folder / "take", "--object", desk.folder / "chair.obj", "-o", output]
    desk.run(*words, way[0], desk.folder / way[1])
    _check(desk, output, "session")
    with pytest.raises(InputError) as caught:
        desk.run(*words, way[0], desk.folder / way[1])
    assert caught.value.code == "output-exists"


def test_session_needs_one_way_to_know_the_object(desk: Desk, tmp_path: Path):
    words = ["session", desk.folder / "take", "--object", desk.folder / "chair.obj"]
    for more in ([], ["--board", "A4"], ["--scan", "a.obj", "--object-pose", "b.txt"]):
        with pytest.raises(InputError) as caught:
            desk.run(*words, "-o", tmp_path / "mount.json", *more)
        assert caught.value.code == "session-ways"


@pytest.mark.parametrize("text", ["12", "5:3", "a:b", "-1:2"])
def test_a_still_that_is_no_stretch_of_time(desk: Desk, tmp_path: Path, text: str):
    words = ["session", desk.folder / "take", "--object", desk.folder / "chair.obj"]
    words += ["--object-pose", desk.folder / "pose.txt", "-o", tmp_path / "mount.json"]
    with pytest.raises(InputError) as caught:
        desk.run(*words, f"--still={text}")
    assert caught.value.code == "still-unreadable"
