"""`omocap calibrate combine`: mount files in, one mount file and what is known of it out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from capture_app.cli.calibrate.mounts import combine
from capture_app.simulator.demo_take import clamped_phone
from ingest.mount import Mount
from ingest.mount_file import load_mount, save_mount
from ingest.uncertainty import bounds_95, moved
from omomo_core.errors import InputError

SURE = np.diag([np.radians(0.5) ** 2] * 3 + [0.004**2] * 3)


def write(path: Path, step: list[float], covariance: np.ndarray = SURE, **more) -> Path:
    T = moved(clamped_phone().T_phone_object, np.array(step, float))
    save_mount(Mount(T, path.stem, covariance, **more), path)
    return path


def test_two_files_become_a_surer_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    up = 0.3**2 * np.outer(np.eye(6)[4], np.eye(6)[4])
    board = write(tmp_path / "board.json", [0, 0, 0, 0, 0.3, 0], SURE + up, free=("height",))
    scan = write(tmp_path / "scan.json", [0.002, 0, 0, 0.002, 0, 0], phone="iPhone 15")
    combine([board, scan], tmp_path / "both.json")
    found = load_mount(tmp_path / "both.json")
    assert found.method == "board and scan, combined"
    assert (found.phone, found.free) == ("iPhone 15", ())
    assert found.covariance is not None
    assert bounds_95(found.covariance).deg < bounds_95(SURE).deg
    truth = clamped_phone().T_phone_object
    np.testing.assert_allclose(found.T_phone_object[:3, 3], truth[:3, 3], atol=0.003)
    printed = capsys.readouterr().out
    assert "board.json, " in printed
    assert "both.json" in printed
    assert "mm and" in printed


def test_what_disagrees_writes_nothing_and_of_one_take_it_is_a_slip(tmp_path: Path):
    start = write(tmp_path / "start.json", [0] * 6)
    end = write(tmp_path / "end.json", [0.1, 0, 0, 0.03, 0, 0])
    out = tmp_path / "out.json"
    for same_take, code in ((False, "mounts-disagree"), (True, "mount-slipped")):
        with pytest.raises(InputError) as caught:
            combine([start, end], out, same_take=same_take)
        assert caught.value.code == code
        assert not out.exists()
    third = write(tmp_path / "third.json", [0] * 6)
    with pytest.raises(InputError, match="one start and one end"):
        combine([start, end, third], out, same_take=True)
    combine([start, third], out, same_take=True)
    with pytest.raises(InputError) as caught:
        combine([start, third], out)
    assert caught.value.code == "output-exists"


def test_a_mount_without_covariance_is_named(tmp_path: Path):
    start = write(tmp_path / "start.json", [0] * 6)
    save_mount(replace(clamped_phone(), covariance=None), tmp_path / "hand.json")
    with pytest.raises(InputError) as caught:
        combine([start, tmp_path / "hand.json"], tmp_path / "out.json")
    assert caught.value.where == str(tmp_path / "hand.json")
