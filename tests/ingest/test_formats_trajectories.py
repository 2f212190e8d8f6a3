"""ARKitRecorder, iPhUMI, ScanNet++ and Spectacular AI: JSON logs; and no app claims another's."""

import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ingest.formats import (
    anysense,
    arkit_data_logger,
    arkit_recorder,
    arkitscenes,
    ios_logger,
    iphumi,
    scan_capture,
    scannetpp,
    spectacular,
    stray_scanner,
    tum,
)
from ingest.session import CaptureSession
from omomo_core.errors import InputError

JSON = (arkit_recorder, iphumi, scannetpp, spectacular)
TEXT = (stray_scanner, ios_logger, arkit_data_logger, scan_capture, anysense, tum, arkitscenes)
POSE_FILE = {
    arkit_recorder.NAME: "omocap.json",
    iphumi.NAME: "omocap.json",
    scannetpp.NAME: "pose_intrinsic_imu.json",
    spectacular.NAME: "data.jsonl",
    stray_scanner.NAME: "odometry.csv",
    ios_logger.NAME: "ARposes.txt",
    arkit_data_logger.NAME: "ARKit_camera_pose.txt",
    scan_capture.NAME: "poses.txt",
    anysense.NAME: "AR_Pose_omocap.txt",
    tum.NAME: "trajectory.txt",
    arkitscenes.NAME: "lowres_wide.traj",
}
MATRIX = {arkit_recorder.NAME: "cameraTransform", scannetpp.NAME: "pose"}
every_json = pytest.mark.parametrize("format_", JSON, ids=lambda f: f.NAME)
every_format = pytest.mark.parametrize("format_", JSON + TEXT, ids=lambda f: f.NAME)
named_frames = pytest.mark.parametrize("format_", [arkit_recorder, scannetpp], ids=lambda f: f.NAME)
seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def take(wander: Callable[..., CaptureSession]) -> Callable[[int], CaptureSession]:
    """Two seconds at 20 poses a second."""
    return lambda seed: wander(seed, seconds=2.0, rate=20.0)


def _log(format_, session: CaptureSession, folder: Path) -> Path:
    return format_.write(session, folder) / POSE_FILE[format_.NAME]


def _edit(log: Path, change: Callable[[Any], None]) -> None:
    value = json.loads(log.read_text())
    change(value)
    log.write_text(json.dumps(value))


def _error(format_, path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        format_.read(path)
    return caught.value


@every_json
@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_round_trip(take, format_, seed: int):
    session = take(seed)
    with tempfile.TemporaryDirectory() as folder:
        back = format_.read(format_.write(session, Path(folder)))
    stamps = 0.000501 if format_ is iphumi else 1e-9
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=stamps)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=1e-12)
    K = session.intrinsics
    expected = K if format_ is not iphumi else np.tile(K[0], (len(K), 1))
    np.testing.assert_allclose(back.intrinsics, expected, rtol=1e-12)
    assert back.image_size == (1920, 1440)
    assert back.app == format_.NAME


@every_json
def test_without_a_camera(take, tmp_path: Path, format_):
    session = replace(take(0), intrinsics=None, image_size=None, video_times=None)
    back = format_.read(format_.write(session, tmp_path))
    assert back.intrinsics is None
    assert back.image_size is None
    assert format_.detect(tmp_path)


@pytest.mark.parametrize("format_", [iphumi, scannetpp, spectacular], ids=lambda f: f.NAME)
def test_the_video_travels_with_its_times(take, tmp_path: Path, format_):
    (tmp_path / "clip").write_bytes(b"pictures")
    session = replace(take(3), video=tmp_path / "clip")
    back = format_.read(format_.write(session, tmp_path / "take"))
    assert back.video is not None
    assert back.video.read_bytes() == b"pictures"
    np.testing.assert_allclose(back.video_times, session.times, rtol=0, atol=0.000501)


def test_arkit_recorder_as_the_app_writes_it(tmp_path: Path):
    """Frames in no order, single precision, other keys, and images for some of them."""
    frames = {
        f"{41005.0 + i / 10:.6f}.jpg": {
            "cameraPos": {"y": 2, "x": 1 + i / 100, "z": 3},
            "cameraTransform": [[1, 0, 0, 1 + i / 100], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 0.9999999]],
            "cameraIntrinsics": [[1089.032, 0, 639.5], [0, 1089.032, 359.5], [0, 0, 1]],
            "lightEstimate": 900,
            "imageResolution": {"height": 720, "width": 1280},
            "ARPointCloud": {"count": 1, "points": [[0.009132311, -0.1209963, -0.3236341]]},
            "timeStamp": 41005.0 + i / 10,
        }
        for i in reversed(range(15))
    }  # fmt: skip
    (tmp_path / "3-20-23-27.json").write_text(json.dumps(frames))
    (tmp_path / "41005.300000.jpg").write_bytes(b"\xff\xd8")
    session = arkit_recorder.read(tmp_path)
    np.testing.assert_allclose(session.times, 41005.0 + np.arange(15) / 10)
    np.testing.assert_allclose(session.T_world_phone[4, :3, 3], [1.04, 2, 3])
    assert session.intrinsics is not None
    assert session.intrinsics[2].tolist() == [1089.032, 1089.032, 639.5, 359.5]
    assert session.image_size == (1280, 720)
    assert session.images == (tmp_path / "41005.300000.jpg",)
    assert session.video_times is not None
    assert session.video_times.tolist() == [41005.3]


def test_scannetpp_aligned_pose_is_opencv_and_z_up(take, tmp_path: Path):
    T = take(0).T_world_phone.copy()
    T[:, :3, :3] = np.eye(3)
    T[0, :3, 3] = [1, 2, 3]
    log = _log(scannetpp, replace(take(0), T_world_phone=T), tmp_path)
    frame = json.loads(log.read_text())["frame_000000"]
    assert frame["pose"] == T[0].tolist()
    level = [[1, 0, 0, 1], [0, 0, 1, -3], [0, -1, 0, 2], [0, 0, 0, 1]]
    np.testing.assert_allclose(frame["aligned_pose"], level)


def test_scannetpp_does_not_take_the_aligned_pose_for_the_pose(take, tmp_path: Path):
    log = _log(scannetpp, take(0), tmp_path)
    _edit(log, lambda frames: [frame.pop("pose") for frame in frames.values()])
    assert scannetpp.detect(tmp_path)
    error = _error(scannetpp, tmp_path)
    assert error.code == "pose-missing"
    assert error.where == f"{log}, frame_000000"


def test_iphumi_times_are_iso_texts(take, tmp_path: Path):
    log = _log(iphumi, take(0), tmp_path)
    start = 1726403696.789

    def put(recording: Any) -> None:
        count = len(recording["poseTimes"])
        recording["poseTimes"] = [
            f"2024-09-15T12:{34 + i // 60}:{i % 60:02d}.789Z" for i in range(count)
        ]
        recording["poseTimes"][0] = "2024-09-15T14:34:00.789+02:00"

    _edit(log, put)
    times = iphumi.read(tmp_path).times
    np.testing.assert_allclose(times, start - 56 + np.arange(len(times)), atol=1e-6)
    _edit(log, lambda recording: recording["poseTimes"].__setitem__(7, "noon"))
    error = _error(iphumi, tmp_path)
    assert error.code == "log-damaged"
    assert "'noon'" in error.what
    assert error.where == f"{log}, poseTimes[7]"


def test_iphumi_needs_a_time_for_each_pose(take, tmp_path: Path):
    log = _log(iphumi, take(0), tmp_path)
    _edit(log, lambda recording: recording["poseTimes"].pop())
    error = _error(iphumi, tmp_path)
    assert error.code == "log-damaged"
    assert "poseTransforms" in error.where


def _spectacular(folder: Path, *lines: dict[str, Any]) -> Path:
    camera = {"imuToCamera": [[1, 0, 0, 0.1], [0, 0, -1, 0.2], [0, 1, 0, 0.3], [0, 0, 0, 1]]}
    (folder / "calibration.json").write_text(json.dumps({"cameras": [camera]}))
    log = folder / "data.jsonl"
    log.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    return log


def _pose(i: int) -> dict[str, Any]:
    position = {"x": i / 100, "y": 0, "z": 1}
    return {"position": position, "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}}


def test_spectacular_gives_the_camera_not_the_imu(tmp_path: Path):
    """The IMU lies level, 1 m up; the camera looks along its y and has it at (.1, .2, .3)."""
    sensor = {"sensor": {"type": "gyroscope", "values": [0, 0, 0]}, "time": -1}
    _spectacular(tmp_path, sensor, *({"vio": _pose(i), "time": i / 10} for i in range(15)))
    session = spectacular.read(tmp_path)
    np.testing.assert_allclose(session.T_world_phone[0, :3, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(session.T_world_phone[0, :3, 3], [-0.1, 1.2, 0.3])
    assert session.intrinsics is None
    assert session.video_times is None
    assert session.imu is None


def test_spectacular_prefers_ground_truth_and_does_not_choose_among_methods(tmp_path: Path):
    both = [{"vio": _pose(3 * i), "slam": _pose(i), "time": i / 10} for i in range(15)]
    log = _spectacular(tmp_path, *both)
    error = _error(spectacular, tmp_path)
    assert error.code == "poses-ambiguous"
    assert "vio, slam" in error.what
    _spectacular(tmp_path, *(line | {"groundTruth": _pose(2 * i)} for i, line in enumerate(both)))
    assert spectacular.read(log).T_world_phone[10, 0, 3] == pytest.approx(0.2 - 0.1)


def test_spectacular_needs_poses_and_the_place_of_the_camera(tmp_path: Path):
    frame = {"frames": [{"cameraInd": 0}], "number": 0, "time": 0.0}
    log = _spectacular(tmp_path, frame)
    assert spectacular.detect(tmp_path)
    assert _error(spectacular, tmp_path).code == "poses-missing"
    _spectacular(tmp_path, *({"groundTruth": _pose(i), "time": i / 10} for i in range(15)))
    (tmp_path / "calibration.json").unlink()
    assert _error(spectacular, log).code == "calibration-missing"


def test_spectacular_names_the_line(take, tmp_path: Path):
    log = _log(spectacular, take(0), tmp_path)
    lines = log.read_text().split("\n")
    cases = {
        "log-damaged": lines[20][:-9],
        "log-not-finite": lines[20].replace('"x": ', '"x": NaN, "was": ', 1),
        "log-key-missing": lines[20].replace('"w"', '"v"'),
        "pose-not-unit": lines[20].replace('"w": ', '"w": 3.0, "was": '),
    }
    for code, line in cases.items():
        log.write_text("\n".join([*lines[:20], line, *lines[21:]]))
        error = _error(spectacular, tmp_path)
        assert error.code == code
        assert "line 21" in error.where
    log.write_text("\n".join(lines[:60])[:-5])
    error = _error(spectacular, tmp_path)
    assert error.code == "log-truncated"
    assert "line 60" in error.where


@every_json
def test_cut_short(take, tmp_path: Path, format_):
    log = _log(format_, take(0), tmp_path)
    log.write_text(log.read_text()[:-40])
    assert format_.detect(tmp_path)
    error = _error(format_, tmp_path)
    assert error.code == "log-truncated"
    assert str(log) in error.where


@named_frames
def test_transposed_matrices(take, tmp_path: Path, format_):
    log = _log(format_, take(0), tmp_path)

    def transpose(frames: Any) -> None:
        frame = frames[sorted(frames)[5]]
        frame[MATRIX[format_.NAME]] = np.array(frame[MATRIX[format_.NAME]]).T.tolist()

    _edit(log, transpose)
    error = _error(format_, tmp_path)
    assert error.code == "pose-not-rigid"
    assert "transposed" in error.what
    assert error.where.endswith(sorted(json.loads(log.read_text()))[5])


@named_frames
def test_transposed_camera_matrices(take, tmp_path: Path, format_):
    log = _log(format_, take(0), tmp_path)
    key = {arkit_recorder.NAME: "cameraIntrinsics"}.get(format_.NAME, "intrinsic")

    def transpose(frames: Any) -> None:
        for frame in frames.values():
            frame[key] = np.array(frame[key]).T.tolist()

    _edit(log, transpose)
    assert _error(format_, tmp_path).code == "camera-damaged"


@every_json
def test_not_finite(take, tmp_path: Path, format_):
    log = _log(format_, take(0), tmp_path)
    number = repr(float(take(0).T_world_phone[4, 1, 3]))
    text = log.read_text()
    if format_ is spectacular:
        number = text.split("\n")[4].split('"z": ')[1].split("}")[0]
    assert number in text
    log.write_text(text.replace(number, "NaN", 1))
    assert _error(format_, tmp_path).code == "log-not-finite"


@pytest.mark.parametrize("format_", [iphumi, scannetpp, spectacular], ids=lambda f: f.NAME)
def test_time_going_backwards(take, tmp_path: Path, format_):
    session = take(0)
    times = session.times.copy()
    times[20:] -= 0.5
    format_.write(replace(session, times=times), tmp_path)
    error = _error(format_, tmp_path)
    assert error.code == "time-backwards"
    assert error.where.endswith(("pose 20", "frame_000020", "line 21"))


@every_json
def test_less_than_a_second(wander, tmp_path: Path, format_):
    format_.write(wander(0, seconds=0.8), tmp_path)
    assert _error(format_, tmp_path).code == "log-short"


@named_frames
def test_nothing_inside(tmp_path: Path, format_):
    log = tmp_path / POSE_FILE[format_.NAME]
    log.write_text("{}")
    assert _error(format_, log).code == "log-short"


@every_format
def test_only_its_own_app_claims_a_session(take, tmp_path: Path, format_):
    folder = format_.write(take(0), tmp_path / "take")
    renamed = tmp_path / "my take.log"
    renamed.write_bytes((folder / POSE_FILE[format_.NAME]).read_bytes())
    for path in (folder, folder / POSE_FILE[format_.NAME], renamed):
        assert [other.NAME for other in JSON + TEXT if other.detect(path)] == [format_.NAME]


@settings(max_examples=30, deadline=None)
@given(
    head=st.sampled_from(
        [b"", b"{", b"[[", b'{"time": 1}\n', b'"<', b"# up: z\n", b"1 2 3 4 5 6 7"]
    ),
    tail=st.binary(max_size=200),
    ending=st.sampled_from(
        ["poses.txt", "data.jsonl", "a.json", "pose_intrinsic_imu.json", "a.traj"]
    ),
)
def test_looking_at_garbage_never_raises(head: bytes, tail: bytes, ending: str):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / ending
        file.write_bytes(head + tail)
        for format_ in (*JSON, scan_capture, anysense, tum, arkitscenes):
            for path in (file, Path(folder)):
                if format_.detect(path):
                    with pytest.raises(InputError):
                        format_.read(path)
