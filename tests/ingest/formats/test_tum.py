"""TUM trajectories: comments say how the axes point and which way is up."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ingest.formats import tum
from ingest.formats.registry import read_session
from ingest.session import CaptureSession
from tests.ingest.formats.logs import MakeTake, error_of
from tests.log_writers import write_session


@pytest.mark.parametrize("aligned", [True, False])
def test_whether_it_is_aligned_with_gravity_comes_back(
    take: MakeTake, tmp_path: Path, aligned: bool
):
    session = replace(take(0), gravity_aligned=aligned)
    back = read_session(write_session(tum, session, tmp_path))
    assert back.gravity_aligned is aligned
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=1e-8)


def _write(folder: Path, comments: str) -> Path:
    rows = [f"{i / 10} {1 + i / 100} 2 3 0 0 0 1" for i in range(20)]
    (folder / "t.txt").write_text("\n".join([comments, *rows, ""]))
    return folder / "t.txt"


def _read(folder: Path, comments: str) -> CaptureSession:
    return tum.read(_write(folder, comments))


def test_comments_say_how_the_axes_point(tmp_path: Path):
    session = _read(tmp_path, "# axes: arkit\n# up: y")
    np.testing.assert_allclose(session.T_world_phone[0, :3, :3], np.eye(3))
    assert session.T_world_phone[0, :3, 3].tolist() == [1, 2, 3]
    assert session.gravity_aligned
    session = _read(tmp_path, "# ground truth\n#up:z")
    assert session.T_world_phone[0, :3, 3].tolist() == [1, 3, -2]
    assert session.gravity_aligned
    # OpenCV's camera with the axes of a z-up world looks at the sky: ARKit's z points down.
    np.testing.assert_allclose(session.T_world_phone[0, :3, 2], [0, -1, 0])


def test_without_a_word_about_up_it_is_not_gravity_aligned(tmp_path: Path):
    session = _read(tmp_path, "# timestamp tx ty tz qx qy qz qw")
    assert not session.gravity_aligned
    assert session.T_world_phone[0, :3, 3].tolist() == [1, 2, 3]
    assert session.camera_open
    assert session.world_axes


@pytest.mark.parametrize("comment", ["# up: x", "# axes: nerf"])
def test_comments_that_are_not_understood(tmp_path: Path, comment: str):
    error = error_of(_write(tmp_path, f"# mine\n{comment}"))
    assert error.code == "axes-unknown"
    assert error.where.endswith("t.txt:2")
