"""Keyframes in CSV and JSON."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.animated.detect import read_animation

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


def write_json(path: Path, keys: list[dict[str, object]], **rest: object) -> Path:
    path.write_text(json.dumps({**rest, "keyframes": keys}))
    return path


def keyed(poses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    frames = np.cumsum([frames for frames, _, _ in poses])
    quaternions = Rotation.from_rotvec([turn for _, _, turn in poses]).as_quat()
    return frames, np.array([place for _, place, _ in poses]), quaternions


@given(POSES, st.sampled_from(["bezier", "linear", "constant"]))
@SETTINGS
def test_keys_come_back_whatever_the_kind(tmp_path, poses, mode):
    """At 30 fps every frame with a key shows the key, and CSV and JSON say the same between."""
    frames, places, xyzw = keyed(poses)
    rows = [[f, *p, *q] for f, p, q in zip(frames, places, xyzw, strict=True)]
    comments = ["# fps: 30", f"# interpolation: {mode}"]
    table = read_animation(write_csv(tmp_path / "a.csv", "frame", rows, *comments))
    keys = [
        {"frame": int(f), "position": list(p), "quaternion": list(-q)}
        for f, p, q in zip(frames, places, xyzw, strict=True)
    ]
    text = read_animation(write_json(tmp_path / "a.json", keys, fps=30, interpolation=mode.upper()))
    T = table.T_file_object
    assert len(T) == frames[-1] - frames[0] + 1
    at = frames - frames[0]
    np.testing.assert_allclose(T[at, :3, 3], places, atol=1e-9)
    np.testing.assert_allclose(T[at, :3, :3], Rotation.from_quat(xyzw).as_matrix(), atol=1e-9)
    np.testing.assert_allclose(text.T_file_object, T, atol=1e-9)


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


def test_bezier_handles_are_obeyed(tmp_path):
    """Handles at a third of a straight line make that line."""

    def key(frame: int, x: float) -> dict[str, object]:
        def handle(side: int) -> dict[str, object]:
            stamp = frame + side * 8
            points = [[stamp, x + side * 1.0], [stamp, 0], [stamp, 0]]
            return {"position": points, "quaternion": [[stamp, 0]] * 3 + [[stamp, 1]]}

        pose = {"frame": frame, "position": [x, 0, 0], "quaternion": [0, 0, 0, 1]}
        return {**pose, "handle_left": handle(-1), "handle_right": handle(1)}

    read = read_animation(write_json(tmp_path / "a.json", [key(0, 0.0), key(24, 3.0)], fps=24))
    np.testing.assert_allclose(read.T_file_object[:, 0, 3], np.linspace(0, 3, 31), atol=1e-9)


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
    bounce = [[*row, "bounce"] for row in GOOD]
    assert "a.csv:2" in refused(
        "interpolation-unknown", read_animation, write_csv(path, "time", bounce)
    )
    path.write_text("time,x,y,z,rx,ry,rz\n0,0,0,0,0,0,0\n")
    assert "qx" in refused("csv-columns", read_animation, path)
    refused("node-unused", read_animation, write_csv(path, "time", good), "Chair")


def test_a_bad_json_is_told_where(tmp_path, refused):
    path = tmp_path / "a.json"
    pose = {"position": [0, 0, 0], "quaternion": [0, 0, 0, 1]}
    first, second = {"time": 0, **pose}, {"time": 1, **pose}
    refused("keyframes-damaged", read_animation, write_json(path, [{"time": 0}]))
    told = refused(
        "keyframes-damaged",
        read_animation,
        write_json(path, [first, {**second, "position": [0, float("nan"), 0]}]),
    )
    assert "keyframes.1.position" in told
    refused("keyframes-damaged", read_animation, write_json(path, [first, second], interpol="x"))
    refused("keyframes-clock", read_animation, write_json(path, [first, {"frame": 3, **pose}]))
    refused("fps-missing", read_animation, write_json(path, [{"frame": 3, **pose}]))
    handle = {"position": [[0, 0]] * 3, "quaternion": [[0, 0]] * 4}
    refused(
        "keyframes-handles",
        read_animation,
        write_json(path, [{**first, "handle_left": handle}, second]),
    )
    refused("time-backwards", read_animation, write_json(path, [second, first]))
    refused("animation-one-key", read_animation, write_json(path, []))
