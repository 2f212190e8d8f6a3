"""ScanCapture, AnySense, TUM and ARKitScenes: text logs, read as they are written."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ingest.formats import anysense, arkitscenes, scan_capture, tum
from ingest.session import CaptureSession, DepthLog
from omomo_core.errors import InputError

TEXT = (scan_capture, anysense, tum, arkitscenes)
POSE_FILE = {
    scan_capture.NAME: "poses.txt",
    anysense.NAME: "AR_Pose_omocap.txt",
    tum.NAME: "trajectory.txt",
    arkitscenes.NAME: "lowres_wide.traj",
}
SEPARATOR = {scan_capture.NAME: ",", anysense.NAME: ",", tum.NAME: " ", arkitscenes.NAME: " "}
X_COLUMN = {scan_capture.NAME: 2, anysense.NAME: 5, tum.NAME: 1, arkitscenes.NAME: 4}
every_format = pytest.mark.parametrize("format_", TEXT, ids=lambda f: f.NAME)
seeds = st.integers(0, 2**32 - 1)

S = np.sqrt(0.5)
LEVEL = {
    scan_capture.NAME: [1, 2, 3, 0, 0, 0, 1],
    anysense.NAME: [0, 0, 0, 1, 1, 2, 3],
    tum.NAME: [1, -3, 2, -S, 0, 0, S],
    arkitscenes.NAME: [np.pi / 2, 0, 0, -1, 2, 3],
}
"""The pose of a phone held level in landscape at (1, 2, 3), looking at the horizon along -z.

In a world that is z up it stands at (1, -3, 2) and looks along +y. OpenCV's camera there is a
quarter turn about x, and from it the origin lies 1 to the left, 2 below and 3 ahead.
"""


def _round_trip(format_, session: CaptureSession) -> CaptureSession:
    with tempfile.TemporaryDirectory() as folder:
        written = format_.write(session, Path(folder) / "take")
        assert format_.detect(written)
        assert format_.detect(written / POSE_FILE[format_.NAME])
        back = format_.read(written)
    assert back.app == format_.NAME
    return back


def _log(format_, session: CaptureSession, folder: Path) -> Path:
    return format_.write(session, folder) / POSE_FILE[format_.NAME]


def _edit(path: Path, line: int, change: Callable[[str], str]) -> None:
    lines = path.read_text().split("\n")
    lines[line - 1] = change(lines[line - 1])
    path.write_text("\n".join(lines))


def _put(separator: str, column: int, value: str) -> Callable[[str], str]:
    def change(line: str) -> str:
        fields = line.split(separator)
        fields[column] = value
        return separator.join(fields)

    return change


def _error(format_, path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        format_.read(path)
    return caught.value


@settings(max_examples=8, deadline=None)
@given(seed=seeds, data=st.data())
def test_scan_capture(wander, seed: int, data):
    session = wander(seed, seconds=1.2)
    flags = data.draw(st.lists(st.booleans(), min_size=73, max_size=73))
    session = replace(session, tracking_ok=np.array(flags))
    back = _round_trip(scan_capture, session)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=1e-8)
    np.testing.assert_allclose(back.intrinsics, session.intrinsics, rtol=0, atol=1e-8)
    np.testing.assert_array_equal(back.tracking_ok, flags)
    assert back.image_size == (1920, 1440)
    assert back.gravity_aligned


@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_anysense(wander, seed: int):
    session = wander(seed, seconds=1.2)
    back = _round_trip(anysense, session)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=0.000501)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=1e-8)
    assert back.intrinsics is None
    assert back.gravity_aligned


@settings(max_examples=8, deadline=None)
@given(seed=seeds, aligned=st.booleans())
def test_tum(wander, seed: int, aligned: bool):
    session = replace(wander(seed, seconds=1.2), gravity_aligned=aligned)
    back = _round_trip(tum, session)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=1e-8)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=1e-8)
    assert back.gravity_aligned == aligned


@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_arkitscenes(wander, seed: int):
    session = wander(seed, seconds=1.2, rate=10.0)
    back = _round_trip(arkitscenes, session)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=1e-8)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, rtol=0, atol=1e-8)
    np.testing.assert_allclose(back.intrinsics, session.intrinsics, rtol=0, atol=1e-6)
    assert back.image_size == (1920, 1440)


@every_format
def test_a_level_phone_that_looks_at_the_horizon(wander, tmp_path: Path, format_):
    session = wander(0)
    T = session.T_world_phone.copy()
    T[:] = np.eye(4)
    T[:, :3, 3] = [1, 2, 3]
    T[1:, 0, 3] += 0.01 * np.arange(len(T) - 1)
    log = _log(format_, replace(session, T_world_phone=T), tmp_path)
    row = next(line for line in log.read_text().split("\n") if not line.startswith("#"))
    first = 2 if format_ is scan_capture else 1
    fields = row.split(SEPARATOR[format_.NAME])[first:]
    level = LEVEL[format_.NAME]
    numbers = [float(field) for field in fields[: len(level)]]
    np.testing.assert_allclose(numbers, level, atol=1e-8)
    np.testing.assert_allclose(format_.read(tmp_path).T_world_phone[0], T[0], atol=1e-8)


def _tum(folder: Path, comments: str) -> CaptureSession:
    rows = [f"{i / 10} {1 + i / 100} 2 3 0 0 0 1" for i in range(20)]
    (folder / "t.txt").write_text("\n".join([comments, *rows, ""]))
    return tum.read(folder / "t.txt")


def test_tum_comments_say_how_the_axes_point(tmp_path: Path):
    session = _tum(tmp_path, "# axes: arkit\n# up: y")
    np.testing.assert_allclose(session.T_world_phone[0, :3, :3], np.eye(3))
    assert session.T_world_phone[0, :3, 3].tolist() == [1, 2, 3]
    assert session.gravity_aligned
    session = _tum(tmp_path, "# ground truth\n#Up:z".replace("Up", "up"))
    assert session.T_world_phone[0, :3, 3].tolist() == [1, 3, -2]
    assert session.gravity_aligned
    # OpenCV's camera with the axes of a z-up world looks at the sky: ARKit's z points down.
    np.testing.assert_allclose(session.T_world_phone[0, :3, 2], [0, -1, 0])


def test_tum_without_a_word_about_up_is_not_gravity_aligned(tmp_path: Path):
    session = _tum(tmp_path, "# timestamp tx ty tz qx qy qz qw")
    assert not session.gravity_aligned
    assert session.T_world_phone[0, :3, 3].tolist() == [1, 3, -2]


@pytest.mark.parametrize("comment", ["# up: x", "# axes: nerf"])
def test_tum_comments_that_are_not_understood(tmp_path: Path, comment: str):
    with pytest.raises(InputError) as caught:
        _tum(tmp_path, f"# mine\n{comment}")
    assert caught.value.code == "axes-unknown"
    assert caught.value.where.endswith("t.txt:2")


def test_scan_capture_states_are_normal_or_not(wander, tmp_path: Path):
    log = _log(scan_capture, wander(0), tmp_path)
    for line, status in enumerate(scan_capture.STATUSES, start=2):
        _edit(log, line, _put(",", 1, f" {status}"))
    ok = scan_capture.read(tmp_path).tracking_ok
    assert ok is not None
    assert ok[:8].tolist() == [True, *[False] * 6, True]


def test_scan_capture_refuses_a_state_that_it_does_not_know(wander, tmp_path: Path):
    log = _log(scan_capture, wander(0), tmp_path)
    _edit(log, 9, _put(",", 1, " fine"))
    error = _error(scan_capture, tmp_path)
    assert error.code == "tracking-unknown"
    assert error.where == f"{log}:9"
    assert "'fine'" in error.what
    assert "excessive motion" in error.what


def test_scan_capture_refuses_images_that_change_size(wander, tmp_path: Path):
    log = _log(scan_capture, wander(0), tmp_path)
    _edit(log, 40, _put(",", 9, " 1280"))
    error = _error(scan_capture, tmp_path)
    assert (error.code, error.where) == ("image-size", f"{log}:40")


def test_scan_capture_without_a_camera(wander, tmp_path: Path):
    scan_capture.write(replace(wander(0), intrinsics=None), tmp_path)
    back = scan_capture.read(tmp_path)
    assert back.intrinsics is None
    assert back.image_size is None


def _with_depth(session: CaptureSession) -> tuple[CaptureSession, np.ndarray]:
    metres = np.random.default_rng(1).uniform(0, 5, (192, 256)).astype(np.float32).round(3)
    times = session.times[[3, 20]]
    files = (Path("a"), Path("b"))
    log = DepthLog(times, files, lambda file: metres if file.name == "a" else metres * 0)
    return replace(session, depth=log), metres


@pytest.mark.parametrize("format_", [scan_capture, arkitscenes], ids=lambda f: f.NAME)
def test_depth_maps_travel(wander, tmp_path: Path, format_):
    session, metres = _with_depth(wander(0))
    back = format_.read(format_.write(session, tmp_path)).depth
    assert back is not None
    np.testing.assert_allclose(back.times, session.times[[3, 20]], rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.load(back.files[0]), metres, rtol=0, atol=1e-6)
    assert not back.load(back.files[1]).any()
    back.files[0].write_bytes(back.files[0].read_bytes()[:-7000])
    with pytest.raises(InputError) as caught:
        back.load(back.files[0])
    assert caught.value.code == "depth-damaged"
    assert caught.value.where == str(back.files[0])


def test_the_video_of_scan_capture_travels(wander, tmp_path: Path):
    (tmp_path / "clip.mp4").write_bytes(b"pictures")
    session = replace(wander(3), video=tmp_path / "clip.mp4")
    back = scan_capture.read(scan_capture.write(session, tmp_path / "take"))
    assert back.video is not None
    assert back.video.read_bytes() == b"pictures"
    np.testing.assert_array_equal(back.video_times, back.times)


def test_arkitscenes_intrinsics_belong_to_their_times(wander, tmp_path: Path):
    log = _log(arkitscenes, replace(wander(0), intrinsics=None), tmp_path)
    start = arkitscenes.read(log).times[0]
    (tmp_path / "lowres_wide_intrinsics").mkdir()
    for seconds, f in ((0, 210), (2, 220)):
        name = f"42444949_{start + seconds:.3f}.pincam"
        (tmp_path / "lowres_wide_intrinsics" / name).write_text(f"256 192 {f} {f} 127.5 95.5")
    back = arkitscenes.read(tmp_path)
    assert back.image_size == (256, 192)
    assert back.intrinsics is not None
    np.testing.assert_allclose(back.intrinsics[60], [215, 215, 127.5, 95.5], atol=1e-6)
    (tmp_path / "lowres_wide_intrinsics" / "notes.pincam").write_text("256 192 1 1 1 1")
    error = _error(arkitscenes, tmp_path)
    assert error.code == "log-damaged"
    assert "notes.pincam" in error.where


def test_anysense_names_the_stamps_that_repeat(wander, tmp_path: Path):
    log = _log(anysense, wander(0), tmp_path)
    lines = log.read_text().split("\n")
    for row in (11, 40):
        lines[row] = lines[row - 1].split(",")[0] + "," + lines[row].split(",", 1)[1]
    log.write_text("\n".join(lines))
    error = _error(anysense, tmp_path)
    assert error.code == "time-repeats"
    assert "2 lines" in error.what
    assert "12, 41" in error.what
    assert error.where == f"{log}:12"


@every_format
def test_cut_inside_the_last_line(wander, tmp_path: Path, format_):
    log = _log(format_, wander(0), tmp_path)
    whole = log.read_text().rstrip()
    for missing in (5, 9, 40):
        log.write_text(whole[:-missing] if format_ is not scan_capture else whole[: -missing - 1])
        error = _error(format_, tmp_path)
        assert error.code == "log-truncated"
        assert error.where == f"{log}:{whole.count(chr(10)) + 1}"


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_cut_anywhere_is_an_error_or_exact(wander, tmp_path: Path, data):
    format_ = data.draw(st.sampled_from(TEXT))
    session = replace(wander(5, seconds=1.4), intrinsics=None)
    log = _log(format_, session, tmp_path / format_.NAME)
    whole = log.read_bytes()
    log.write_bytes(whole[: data.draw(st.integers(1, len(whole)))])
    try:
        back = format_.read(log)
    except InputError:
        return
    expected = session.T_world_phone[: len(back.times)]
    np.testing.assert_allclose(back.T_world_phone, expected, rtol=0, atol=4e-6)


@every_format
@pytest.mark.parametrize("bad", ["nan", "-inf"])
def test_not_finite(wander, tmp_path: Path, format_, bad: str):
    log = _log(format_, wander(0), tmp_path)
    _edit(log, 30, _put(SEPARATOR[format_.NAME], X_COLUMN[format_.NAME], bad))
    error = _error(format_, tmp_path)
    assert (error.code, error.where) == ("log-not-finite", f"{log}:30")


@every_format
def test_time_going_backwards(wander, tmp_path: Path, format_):
    session = wander(0)
    times = session.times.copy()
    times[50:] -= 0.5
    log = _log(format_, replace(session, times=times, intrinsics=None), tmp_path)
    error = _error(format_, tmp_path)
    assert error.code == "time-backwards"
    comments = log.read_text().count("#")
    assert error.where == f"{log}:{51 + comments}"


@pytest.mark.parametrize("format_", [scan_capture, anysense, tum], ids=lambda f: f.NAME)
def test_quaternions_that_are_no_rotations(wander, tmp_path: Path, format_):
    log = _log(format_, wander(0), tmp_path)
    column = {scan_capture.NAME: 8, anysense.NAME: 4, tum.NAME: 7}[format_.NAME]
    _edit(log, 17, _put(SEPARATOR[format_.NAME], column, "1.4"))
    error = _error(format_, tmp_path)
    assert (error.code, error.where) == ("pose-not-unit", f"{log}:17")


@every_format
def test_tracking_never_started(wander, tmp_path: Path, format_):
    session = wander(0)
    frozen = np.tile(np.eye(4), (len(session.times), 1, 1))
    format_.write(replace(session, T_world_phone=frozen), tmp_path)
    assert _error(format_, tmp_path).code == "tracking-never-started"


@pytest.mark.parametrize("format_", [anysense, tum, arkitscenes], ids=lambda f: f.NAME)
def test_several_takes_in_one_folder(wander, tmp_path: Path, format_):
    log = _log(format_, replace(wander(0), intrinsics=None), tmp_path)
    second = log.with_name(f"second{log.suffix}")
    second.write_bytes(log.read_bytes())
    assert format_.detect(tmp_path)
    error = _error(format_, tmp_path)
    assert error.code == "session-ambiguous"
    assert "second" in error.what
    assert len(format_.read(second).times) == len(wander(0).times)
