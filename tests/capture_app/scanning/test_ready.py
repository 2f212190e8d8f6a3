"""`omocap scan` on meshes of other apps, as it is typed."""

import numpy as np
import pytest
import trimesh
import typer

from capture_app.cli.scan import scan
from ingest.mesh import load_mesh
from omomo_core.errors import InputError

app = typer.Typer()
app.command()(scan)


def run(*words: object) -> None:
    app([str(word) for word in words], standalone_mode=False)


def _carton(path, scale=1.0, drop=0):
    box = trimesh.creation.box([0.8, 0.4, 0.6]).subdivide()
    box.apply_translation([3.0, -1.0, 2.0])
    box.apply_scale(scale)
    box.update_faces(np.arange(len(box.faces)) >= drop)
    box.export(path)
    return path


@pytest.mark.runs("scan")
def test_a_mesh_in_centimetres_becomes_metres_on_its_base(tmp_path, capsys):
    run(_carton(tmp_path / "carton.obj", 100.0), "-o", tmp_path / "thing.glb")
    mesh = load_mesh(tmp_path / "thing.glb")
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.8, 0.4, 0.6], atol=1e-4)
    np.testing.assert_allclose(mesh.vertices.min(axis=0), [-0.4, -0.2, 0.0], atol=1e-4)
    said = " ".join(capsys.readouterr().out.split())
    assert "taken for centimetres" in said
    assert (tmp_path / "thing.scan" / "report.html").is_file()


def test_the_height_goes_before_the_unit(tmp_path):
    run(_carton(tmp_path / "a.ply", 7.0), "-o", tmp_path / "b.ply", "--height", 0.9)
    mesh = load_mesh(tmp_path / "b.ply")
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [1.2, 0.6, 0.9], atol=1e-4)


def test_an_open_mesh_is_taken_and_said_to_be_open(tmp_path, capsys):
    run(_carton(tmp_path / "a.ply", drop=3), "-o", tmp_path / "b.glb")
    assert ", open" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--box", "1,2,3"], "scan-box"),
        (["--length", "0.4:a,1:b,2"], "scan-length"),
        (["--board", "A9"], "board-text"),
    ],
)
def test_what_is_written_wrongly_is_refused_before_anything_is_made(tmp_path, words, code):
    source = _carton(tmp_path / "a.ply")
    with pytest.raises(InputError) as caught:
        run(source, "-o", tmp_path / "b.glb", *words)
    assert caught.value.code == code
    assert [file.name for file in tmp_path.iterdir()] == ["a.ply"]


def test_a_mesh_is_not_written_as_something_else(tmp_path):
    with pytest.raises(InputError) as caught:
        run(_carton(tmp_path / "a.ply"), "-o", tmp_path / "b.txt")
    assert caught.value.code == "output-ending"
