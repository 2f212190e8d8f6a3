"""`omocap calibrate points | drawing`, as typed."""

from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from capture_app.cli.calibrate.drawing import drawing
from capture_app.cli.calibrate.points import points
from ingest.calibration.phone_body import body_point, phone_body, phone_named
from ingest.mount_file import load_mount
from omomo_core.errors import InputError

PHONE = phone_named("iPhone 15")
CORNERS = ("top left back corner", "top right back corner", "bottom left back", "centre front")


def _run(command: object, *words: object) -> str:
    app = typer.Typer()
    app.command()(command)  # pyright: ignore[reportArgumentType]
    result = CliRunner().invoke(app, [str(word) for word in words])
    if isinstance(result.exception, InputError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def _typed(scale: float = 1.0) -> list[str]:
    """Pairs of an object whose frame is the phone's body."""
    words = []
    for name in CORNERS:
        x, y, z = scale * body_point(PHONE, name)
        words += ["--pair", f"{name} = {x} {y} {z}"]
    return words


def _code(command: object, *words: object) -> str:
    with pytest.raises(InputError) as caught:
        _run(command, *words)
    return caught.value.code


def test_points_typed(tmp_path: Path):
    path = tmp_path / "mount.json"
    pairs = tmp_path / "pairs.json"
    told = _run(points, "-o", path, "--phone", "iphone 15", "--save", pairs, *_typed())
    assert "top left back corner: 0.0 mm" in told
    mount = load_mount(path)
    np.testing.assert_allclose(mount.T_phone_object, phone_body(PHONE)[0], atol=1e-9)
    assert (mount.method, mount.phone) == ("points", "iPhone 15")
    again = tmp_path / "again.json"
    _run(points, pairs, "-o", again, "--phone", "iPhone 15")
    np.testing.assert_allclose(load_mount(again).T_phone_object, mount.T_phone_object, atol=1e-12)
    assert _code(points, pairs, "-o", again, "--phone", "iPhone 15") == "output-exists"


def test_points_with_the_scale(tmp_path: Path):
    path = tmp_path / "mount.json"
    told = _run(points, "-o", path, "--phone", "iPhone 15", "--scale", *_typed(2.0))
    assert "Scale: 0.5 " in told
    assert load_mount(path).object_scale == pytest.approx(0.5)


def test_points_refused(tmp_path: Path):
    path = tmp_path / "mount.json"
    assert _code(points, "-o", path) == "points-few"
    assert _code(points, "-o", path, *_typed()) == "phone-needed"
    assert _code(points, "-o", path, "--ruler", "70 140") == "drawing-numbers"
    assert not path.exists()


def test_a_drawing_in_words_and_as_a_matrix(tmp_path: Path):
    words, matrix = tmp_path / "words.json", tmp_path / "matrix.json"
    turn = "right points +x, top edge points +y"
    _run(drawing, "--phone", "iPhone 15", "--xyz", "0 0 0.5", "--axes", turn, "-o", words)
    mount = load_mount(words)
    expected = phone_body(PHONE)[0] @ [0, 0, -0.5, 1]
    np.testing.assert_allclose(mount.T_phone_object[:3, 3], expected[:3], atol=1e-12)
    pose = np.eye(4)
    pose[2, 3] = 0.5
    (tmp_path / "pose.txt").write_text(str(pose.tolist()))
    _run(drawing, "--phone", "iPhone 15", "--matrix", tmp_path / "pose.txt", "-o", matrix)
    np.testing.assert_allclose(load_mount(matrix).T_phone_object, mount.T_phone_object, atol=1e-12)
    camera = tmp_path / "camera.json"
    _run(drawing, "--of", "camera", "--xyz", "0 0 1", "--quaternion", "0 0 0 1", "-o", camera)
    np.testing.assert_allclose(load_mount(camera).T_phone_object[:3, 3], [0, 0, -1])


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ([], "phone-needed"),
        (["--phone", "iPhone 15"], "drawing-incomplete"),
        (["--phone", "iPhone 15", "--xyz", "0 0 0"], "drawing-incomplete"),
        (["--of", "camera", "--euler", "xyz 0 0 0"], "drawing-incomplete"),
        (
            ["--of", "camera", "--xyz", "0 0 0", "--euler", "x 0", "--axes", "top x, left y"],
            "drawing-twice",
        ),
        (["--of", "camera", "--xyz", "0 0 0", "--matrix", "none.txt"], "drawing-twice"),
    ],
)
def test_a_drawing_with_too_little_or_too_much(tmp_path: Path, words: list[str], code: str):
    assert _code(drawing, "-o", tmp_path / "mount.json", *words) == code
