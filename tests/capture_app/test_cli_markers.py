"""`omocap data markers` as a user calls it: what it writes is a motion that `omocap run` reads."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from capture_app.cli.app import invoke
from ingest.animated.animated_take import to_animated_take
from ingest.animated.detect import is_animation
from ingest.animated.npz_poses import read
from tests.core.marker_files import Capture, capture, moving, write_npz, write_places, write_vicon

SCALE = 0.0123
"""Metres per unit of the scan."""


@pytest.fixture
def made(tmp_path: Path) -> Capture:
    """Five markers on the corners of a box; the scan is a box of another unit."""
    box = trimesh.creation.box((40.0, 30.0, 50.0))
    box.apply_translation((7.0, -3.0, 25.0))
    box.export(tmp_path / "box.obj")
    drawn = capture(np.random.default_rng(0), seconds=2.0)
    corners = np.asarray(box.vertices)[[0, 1, 2, 4, 7]]
    T = moving(drawn.times, drawn.turn)
    points = corners * SCALE @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    write_places(tmp_path / "places.csv", corners)
    return replace(drawn, points=points, places=corners, T=T, scale=SCALE)


def words(folder: Path, tracks: Path, *more: str) -> list[str]:
    paths = [str(tracks), str(folder / "box.obj"), str(folder / "places.csv")]
    return ["data", "markers", *paths, "-o", str(folder / "box_motion.npz"), *more]


@pytest.mark.runs("data markers")
def test_a_vicon_recording_becomes_a_take(
    tmp_path: Path, made: Capture, capsys: pytest.CaptureFixture[str]
) -> None:
    made.points[100:110, 2] += 0.2
    made.points[:12] = np.nan
    assert invoke(words(tmp_path, write_vicon(tmp_path / "take.csv", made))) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "left out: 5.83 to 5.91 s: M3 up to 35 cm off" in told
    assert "no pose: 5.00 to 5.09 s: M1, M2, M3, M4, M5 not seen" in told
    out = tmp_path / "box_motion.npz"
    assert f"omocap run {out} --object {tmp_path / 'box.obj'} --mesh-scale 0.0123 -o RESULT" in told
    assert is_animation(out, mounted=False)
    take = to_animated_take(read(out), tmp_path / "box.obj", scale=SCALE)
    times = 5.1 + np.arange(len(take.motion.valid)) / 30
    truth = moving(times, made.turn)
    truth[:, 2, 3] -= take.floor.height
    np.testing.assert_allclose(take.motion.T_world_object, truth, atol=2e-3)
    assert take.motion.valid.all()


def test_a_world_with_y_up_says_so(tmp_path: Path, made: Capture) -> None:
    y_up = replace(made, points=made.points[..., [0, 2, 1]] * [1, 1, -1])
    tracks = write_npz(tmp_path / "take.npz", y_up)
    assert invoke(words(tmp_path, tracks, "--up", "y", "--start", "5.5", "--end", "6.6")) == 0
    take = to_animated_take(read(tmp_path / "box_motion.npz"), tmp_path / "box.obj", scale=SCALE)
    truth = moving(5.5 + np.arange(len(take.motion.valid)) / 30, made.turn)
    truth[:, 2, 3] -= take.floor.height
    assert 33 <= len(truth) <= 34
    np.testing.assert_allclose(take.motion.T_world_object, truth, atol=2e-3)


def test_a_place_in_the_air_is_told(
    tmp_path: Path, made: Capture, capsys: pytest.CaptureFixture[str]
) -> None:
    trimesh.creation.box((20.0, 20.0, 20.0)).export(tmp_path / "box.obj")
    assert invoke(words(tmp_path, write_npz(tmp_path / "take.npz", made))) == 0
    assert "M1: its place is" in capsys.readouterr().out


def test_what_is_refused_leaves_no_file(
    tmp_path: Path, made: Capture, capsys: pytest.CaptureFixture[str]
) -> None:
    tracks = write_npz(tmp_path / "take.npz", made)
    for more, code in ((["--unit", "mm"], "markers-units"), (["--unit", "ft"], "unknown-unit"),
                       (["--end", "5.5"], "markers-gap")):  # fmt: skip
        assert invoke(words(tmp_path, tracks, *more)) == 2
        assert code in capsys.readouterr().err
    write_places(tmp_path / "places.csv", made.places * [1, 1, 0])
    assert invoke(words(tmp_path, tracks)) == 2
    assert "Traceback" not in capsys.readouterr().err
    assert not (tmp_path / "box_motion.npz").exists()
