"""Keyframes in CSV."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.animated.detect import read_animation
from ingest.animated.keyframes import MODES, interpolate

SETTINGS = settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
POSES = st.lists(
    st.tuples(
        st.integers(3, 40),
        st.tuples(*[st.floats(-2, 2)] * 3),
        st.tuples(*[st.floats(-3, 3)] * 3),
    ),
    min_size=2,
    max_size=6,
)


def write_csv(path: Path, clock: str, rows: list[list[object]], *comments: str) -> Path:
    header = f"{clock},x,y,z,qx,qy,qz,qw"
    width = len(rows[0]) if rows else 8
    header += ",interpolation" if width == 9 else ""
    lines = [*comments, header, *(",".join(str(v) for v in row) for row in rows)]
    path.write_text("\n".join([*lines, ""]))
    return path


def keyed(poses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    frames = np.cumsum([frames for frames, _, _ in poses])
    quaternions = Rotation.from_rotvec([turn for _, _, turn in poses]).as_quat()
    return frames, np.array([place for _, place, _ in poses]), quaternions


@given(POSES, st.sampled_from(MODES))
@SETTINGS
def test_keys_come_back_whatever_the_interpolation(tmp_path, poses, mode):
    """At 30 fps every frame with a key shows the key."""
    frames, places, xyzw = keyed(poses)
    rows = [[f, *p, *q] for f, p, q in zip(frames, places, xyzw, strict=True)]
    comments = ["# fps: 30", f"# interpolation: {mode}"]
    T = read_animation(write_csv(tmp_path / "a.csv", "frame", rows, *comments)).T_file_object
    assert len(T) == frames[-1] - frames[0] + 1
    at = frames - frames[0]
    np.testing.assert_allclose(T[at, :3, 3], places, atol=1e-9)
    np.testing.assert_allclose(T[at, :3, :3], Rotation.from_quat(xyzw).as_matrix(), atol=1e-9)


KEYS = st.lists(st.tuples(st.floats(0.05, 5.0), st.floats(-3.0, 3.0)), min_size=2, max_size=9).map(
    lambda rows: (np.cumsum([step for step, _ in rows]), np.array([[v] for _, v in rows]))
)


@given(KEYS, st.sampled_from(MODES))
@settings(max_examples=30)
def test_curves_go_through_their_keys_and_never_beyond(keys, mode):
    times, values = keys
    at = np.linspace(times[0] - 1, times[-1] + 1, 301)
    curve = interpolate(times, values, [mode] * len(times), at)
    at_keys = interpolate(times, values, [mode] * len(times), times)
    np.testing.assert_allclose(at_keys, values, atol=1e-9)
    k = (np.searchsorted(times, at, side="right") - 1).clip(0, len(times) - 2)
    low = np.minimum(values[k], values[k + 1]) - 1e-9
    high = np.maximum(values[k], values[k + 1]) + 1e-9
    assert ((low <= curve) & (curve <= high)).all()


def test_a_smooth_curve_starts_and_ends_at_rest_and_has_no_corners(tmp_path):
    still = [0, 0, 0, 1]
    rows = [[0, 0, 0, 0, *still], [1, 1, 0, 0, *still], [2, 1.5, 0, 0, *still]]
    x = read_animation(write_csv(tmp_path / "a.csv", "time", rows)).T_file_object[:, 0, 3]
    speed = np.diff(x) * 30
    assert speed[0] < 0.1
    assert speed[-1] < 0.1
    assert np.abs(np.diff(speed)).max() < 0.25


def test_frames_count_by_the_rate_and_times_are_seconds(tmp_path):
    still = [0, 0, 0, 1]
    by_frame = [[1, 0, 0, 0, *still], [25, 2.4, 0, 0, *still]]
    by_time = [[10.0, 0, 0, 0, *still], [11.0, 2.4, 0, 0, *still]]
    linear = "# interpolation: linear"
    a = read_animation(write_csv(tmp_path / "a.csv", "frame", by_frame, "# fps: 24", linear))
    b = read_animation(write_csv(tmp_path / "b.csv", "time", by_time, linear))
    expected = np.linspace(0, 2.4, 31)
    np.testing.assert_allclose(a.T_file_object[:, 0, 3], expected, atol=1e-12)
    np.testing.assert_allclose(b.T_file_object[:, 0, 3], expected, atol=1e-12)
    assert a.up == "z"


def test_each_key_may_have_its_own_interpolation_and_the_world_its_own_up(tmp_path):
    rows = [
        [0, 0, 0, 0, 0, 0, 0, 1, "constant"],
        [1, 1, 0, 0, 0, 0, 0, 1, "LINEAR"],
        [2, 2, 0, 0, 0, 0, 0, 1, ""],
    ]
    read = read_animation(write_csv(tmp_path / "a.csv", "time", rows, "# up: y"))
    x = read.T_file_object[:, 0, 3]
    np.testing.assert_allclose(x[[0, 15, 29, 30, 45, 60]], [0, 0, 0, 1, 1.5, 2], atol=1e-12)
    assert read.up == "y"


GOOD = [[0, 0, 0, 0, 0, 0, 0, 1], [1, 1, 0, 0, 0, 0, 0, 1], [2, 0, 1, 0, 0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("change", "code", "told"),
    [
        ((1, 4, "nan"), "pose-not-finite", "a.csv:3"),
        ((1, 7, "2"), "quaternion-not-unit", "a.csv:3"),
        ((2, 7, "0"), "quaternion-not-unit", "a.csv:4"),
        ((2, 0, "1"), "time-backwards", "a.csv:4"),
        ((2, 0, "0.5"), "time-backwards", "a.csv:4"),
        ((2, 0, "9e9"), "animation-long", "seconds"),
        ((0, 1, "far"), "row-damaged", "a.csv:2"),
    ],
)
def test_a_bad_key_is_named(tmp_path, refused, change, code, told):
    rows: list[list[object]] = [list(row) for row in GOOD]
    row, column, value = change
    rows[row][column] = value
    assert told in refused(code, read_animation, write_csv(tmp_path / "a.csv", "time", rows))


def test_what_is_missing_is_said(tmp_path, refused):
    path = tmp_path / "a.csv"
    refused("fps-missing", read_animation, write_csv(path, "frame", [list(r) for r in GOOD]))
    refused("animation-one-key", read_animation, write_csv(path, "time", [list(GOOD[0])]))
    refused("animation-one-key", read_animation, write_csv(path, "time", []))
    good = [list(r) for r in GOOD]
    refused("comment-unknown", read_animation, write_csv(path, "time", good, "# up: x"))
    refused("comment-unknown", read_animation, write_csv(path, "frame", good, "# fps: fast"))
    for word in ("bounce", "bezier"):
        rows = [[*row, word] for row in GOOD]
        assert "a.csv:2" in refused(
            "interpolation-unknown", read_animation, write_csv(path, "time", rows)
        )
    path.write_text("time,x,y,z,rx,ry,rz\n0,0,0,0,0,0,0\n")
    assert "qx" in refused("csv-columns", read_animation, path)
    refused("node-unused", read_animation, write_csv(path, "time", good), "Chair")
    path.write_text("time,x,y,z,qx,qy,qz,qw,x\n0,0,0,0,0,0,0,1,5\n")
    assert "more than one column x" in refused("csv-columns", read_animation, path)
