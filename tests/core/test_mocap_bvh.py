"""BVH files: any channel order gives the same pose; what is wrong is named with its line."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.errors import InputError
from omomo_core.learning.recordings.bvh_file import read_bvh

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


def two_bones(order: str, values: str, *, frames: int = 1, frame_time: str = "0.04") -> str:
    channels = " ".join(f"{axis}rotation" for axis in order)
    return f"""HIERARCHY
ROOT hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition {channels}
  JOINT arm
  {{
    OFFSET 10 0 0
    CHANNELS 3 {channels}
    End Site
    {{
      OFFSET 0 5 0
    }}
  }}
}}
MOTION
Frames: {frames}
Frame Time: {frame_time}
{values}
"""


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


@settings(max_examples=40)
@given(
    order=st.sampled_from(ORDERS),
    root=st.lists(st.floats(-180, 180), min_size=3, max_size=3),
    arm=st.lists(st.floats(-180, 180), min_size=3, max_size=3),
)
def test_poses_follow_the_channel_order(
    tmp_path_factory: pytest.TempPathFactory, order: str, root: list[float], arm: list[float]
) -> None:
    row = " ".join(str(v) for v in [1, 2, 3, *root, *arm])
    path = write(tmp_path_factory.mktemp("bvh") / "a.bvh", two_bones(order, row))
    bvh = read_bvh(path, metres_per_unit=0.01)
    R_root = Rotation.from_euler(order, root, degrees=True)
    R_arm = R_root * Rotation.from_euler(order, arm, degrees=True)
    elbow = np.array([1, 2, 3]) + R_root.apply([10, 0, 0])
    assert bvh.names == ("hips", "arm", "arm_end")
    assert bvh.parents == (-1, 0, 1)
    np.testing.assert_allclose(bvh.joints[0, 1], elbow / 100, atol=1e-9)
    np.testing.assert_allclose(bvh.joints[0, 2], (elbow + R_arm.apply([0, 5, 0])) / 100, atol=1e-9)
    np.testing.assert_allclose(bvh.rotations[0, 1], R_arm.as_matrix(), atol=1e-9)


def test_frame_rate_and_several_frames(tmp_path: Path) -> None:
    rows = "0 0 0 0 0 0 0 0 0\n0 1 0 0 0 0 0 0 0"
    bvh = read_bvh(write(tmp_path / "a.bvh", two_bones("ZXY", rows, frames=2)), metres_per_unit=1.0)
    assert bvh.fps == pytest.approx(25.0)
    assert bvh.joints[:, 0, 1].tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (two_bones("ZXY", "0 0 0 0 0 zero 0 0 0"), 19),
        (two_bones("ZXY", "0 0 0 0 0 0 0 0 0\n7"), 20),
        (two_bones("ZXY", "0 0 0 0 0 0 0 0"), 19),
        (two_bones("ZXQ", "0"), 5),
        (two_bones("ZZX", "0"), 5),
        (two_bones("ZXY", "0", frame_time="-1"), 18),
        ("HIERARCHY\nROOT a\n{\n  OFFSET 0 0 0\n  CHANNELS 0\n", 5),
        ("HIERARCHY\nMOTION\n", 2),
        ("glTF", 1),
    ],
)
def test_syntax_errors_name_the_line(tmp_path: Path, text: str, line: int) -> None:
    path = write(tmp_path / "broken.bvh", text)
    with pytest.raises(InputError) as caught:
        read_bvh(path, metres_per_unit=0.01)
    assert caught.value.code == "bvh-syntax"
    assert caught.value.where == f"{path}:{line}"


@pytest.mark.parametrize("number", ["nan", "inf"])
def test_a_channel_that_is_no_number_names_the_frame(tmp_path: Path, number: str) -> None:
    rows = f"0 0 0 0 0 0 0 0 0\n0 {number} 0 0 0 0 0 0 0"
    path = write(tmp_path / "a.bvh", two_bones("ZXY", rows, frames=2))
    with pytest.raises(InputError, match="frame 1"):
        read_bvh(path, metres_per_unit=0.01)


def test_no_frames_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_bvh(write(tmp_path / "a.bvh", two_bones("ZXY", "", frames=0)), metres_per_unit=1.0)
    assert caught.value.code == "bvh-empty"
