"""`omocap scan` cuts the object out of the room's mesh that an app made, as it is typed."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import typer

from capture_app.cli.scan import scan
from ingest.mesh import load_mesh
from omomo_core.errors import InputError
from tests.capture_app.scanning.filmed import Scanned
from tests.textured_box import write_textured_box
from tests.textured_room import AT, THING, room, write_room, write_room_of

app = typer.Typer()
app.command()(scan)


def run(*words: object) -> None:
    app([str(word) for word in words], standalone_mode=False)


def refused(*words: object) -> InputError:
    with pytest.raises(InputError) as caught:
        run(*words)
    return caught.value


def test_a_ready_mesh_keeps_its_texture(tmp_path: Path) -> None:
    run(write_textured_box(tmp_path / "box.obj"), "-o", tmp_path / "b.glb", "--up", "y")
    mesh = load_mesh(tmp_path / "b.glb")
    assert mesh.texture is not None
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.5, 0.2, 0.3], atol=1e-6)


def test_a_point_on_it_cuts_the_object_out_of_a_room(tmp_path: Path) -> None:
    path = write_room(tmp_path / "room.obj", room())
    point = f"{AT[0]},{AT[1]},{THING[2]}"
    run(path, f"--at={point}", "-o", tmp_path / "thing.glb")
    mesh = load_mesh(tmp_path / "thing.glb")
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(THING[2], abs=0.01)
    assert mesh.texture is not None
    checks = json.loads((tmp_path / "thing.scan" / "report.json").read_text())["checks"]
    (told,) = [check for check in checks if check["name"] == "cut out"]
    assert "nothing was measured anew" in told["message"]


def test_a_folder_of_an_app_is_its_mesh_though_pictures_lie_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "export"
    folder.mkdir()
    write_room(folder / "room.obj", room())
    assert list(folder.glob("*.png"))
    run(folder, "--method", "mesh", "-o", tmp_path / "thing.glb")
    assert load_mesh(tmp_path / "thing.glb").texture is not None


def test_a_room_is_no_object(tmp_path: Path) -> None:
    path = write_room(tmp_path / "room.glb", room())
    error = refused(path, "-o", tmp_path / "thing.glb")
    assert error.code == "scan-room"
    assert "‹at›" in error.fix
    assert not (tmp_path / "thing.glb").exists()
    assert not (tmp_path / "thing.scan").exists()


def test_a_point_without_a_mesh_to_cut_is_refused(tmp_path: Path, scanned: Scanned) -> None:
    output = tmp_path / "thing.glb"
    assert refused(scanned.film.path, "--at", "0,0,0", "-o", output).code == "scan-at"
    missing = refused(scanned.film.path, "--method", "mesh", "-o", output)
    assert missing.code == "scan-mesh-missing"


def test_the_phone_of_a_session_was_held_towards_the_object(
    tmp_path: Path, scanned: Scanned
) -> None:
    session = tmp_path / "session"
    shutil.copytree(scanned.film.path, session)
    write_room_of(scanned.film, session)
    run(session, "--method", "mesh", "-o", tmp_path / "thing.glb", "--height", "0.31")
    mesh = load_mesh(tmp_path / "thing.glb")
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(0.31, abs=1e-4)
    refused(session, "--method", "mesh", "--at", "9,9,9", "-o", tmp_path / "other.glb")
