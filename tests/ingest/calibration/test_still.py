"""When the clamped phone stands still, and how well its place is known then."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_app.simulator.simulated_phone import NO_NOISE
from ingest.calibration.still import (
    Still,
    break_between,
    clamped_stills,
    disagreeing,
    find_stills,
    named_stills,
    walked,
)
from ingest.formats.registry import read_session
from ingest.session import CaptureSession
from ingest.uncertainty import between, bounds_95, moved
from omomo_core.errors import InputError
from tests.simulator.scan_log import ORBIT, STILLS, scan_log
from tests.simulator.scan_scene import ScanScene, scan_scene


@pytest.fixture(scope="module")
def scene() -> ScanScene:
    return scan_scene(3)


@pytest.fixture(scope="module")
def log(scene: ScanScene) -> CaptureSession:
    return scan_log(scene, seed=3)[0]


def _part(log: CaptureSession, kept: np.ndarray) -> CaptureSession:
    return replace(
        log, times=log.times[kept], T_world_phone=log.T_world_phone[kept], intrinsics=None
    )


def test_the_rests_of_the_clamped_phone_are_found(log: CaptureSession):
    found = find_stills(log)
    assert len(found) == len(STILLS)
    for still, (start, stop) in zip(found, STILLS, strict=True):
        assert still.start == pytest.approx(start, abs=0.3)
        assert still.stop == pytest.approx(stop, abs=0.3)
    stills, note = clamped_stills(log, path=1.0)
    assert [str(still) for still in stills] == [str(still) for still in found]
    assert note == ""


@pytest.mark.parametrize("name", ["arkit_data_logger", "ios_logger_pyojinkim"])
def test_a_phone_in_the_hand_is_never_still(shared: Path, name: str):
    folder = shared / "data" / "capture" / name
    logs = sorted(folder.glob("ARKit_camera_pose*.txt")) or [folder]
    for path in logs:
        assert find_stills(read_session(path)) == []


def test_the_mean_pose_is_as_good_as_it_says(scene: ScanScene):
    T_world_phone = scene.T_world_clamped
    off = []
    for seed in range(12):
        log, T_arkit_world = scan_log(scene, seed=seed)
        still = find_stills(log)[0]
        step = between(still.T_world_phone, T_arkit_world @ T_world_phone)
        off.append(step @ np.linalg.solve(still.jitter, step))
    # Chi-squared with 6 degrees of freedom, and jitter that is a little less correlated than said.
    assert 0.5 < np.mean(off) < 7


def test_a_phone_at_rest_does_not_walk(log: CaptureSession):
    assert walked(log, STILLS[0][0] + 0.2, STILLS[0][1] - 0.2) == 0
    assert walked(log, 0.0, ORBIT) == pytest.approx(2 * 2 * np.pi * 1.3, rel=0.1)


@settings(max_examples=15)
@given(path=st.floats(0, 50), more=st.floats(0.5, 20))
def test_the_farther_it_walked_the_less_is_known(path: float, more: float):
    still = Still(15.0, 17.0, np.eye(4), 1e-8 * np.eye(6))
    near, far = (bounds_95(still.covariance(p)) for p in (path, path + more))
    assert near.mm < far.mm
    assert near.deg < far.deg
    # Half a percent of the path is the expected drift.
    assert far.mm > 5 * (path + more)


def test_without_a_rest_nothing_is_guessed(log: CaptureSession):
    part = _part(log, log.times - log.times[0] < ORBIT)
    with pytest.raises(InputError) as caught:
        clamped_stills(part)
    assert caught.value.code == "no-still"


def test_a_rest_before_the_phone_was_carried_is_none_of_the_clamp(log: CaptureSession):
    part = _part(log, log.times - log.times[0] > STILLS[0][0] - 0.5)
    assert len(clamped_stills(part)[0]) == 2
    # The path between its two rests is less than what a scan takes.
    with pytest.raises(InputError) as caught:
        clamped_stills(part, path=3.0)
    assert caught.value.code == "no-still"


def test_an_object_off_its_mark_at_the_end(scene: ScanScene):
    step = np.array([0, 0, 0.4, 0.5, 0.1, 0])
    log, _ = scan_log(scene, seed=0, end=moved(scene.T_world_clamped, step))
    stills, note = clamped_stills(log, path=1.0)
    assert len(stills) == 1
    assert stills[0].stop < STILLS[1][0]
    assert "21." in note
    assert "0.5" in note


def test_a_jump_between_the_rests(log: CaptureSession):
    T = log.T_world_phone.copy()
    T[log.times - log.times[0] > 19.0, :3, 3] += [0.06, 0, 0]
    broken = replace(log, T_world_phone=T)
    stills, note = clamped_stills(broken, path=1.0)
    assert len(stills) == 1
    assert "tracking jump at 19.0 s" in note
    assert break_between(broken, 15.0, 18.0) is None


@pytest.mark.parametrize(
    ("span", "code"), [((3.0, 4.0), "still-moves"), ((30.0, 31.0), "still-span")]
)
def test_seconds_named_wrongly(log: CaptureSession, span: tuple[float, float], code: str):
    with pytest.raises(InputError) as caught:
        named_stills(log, [(15.5, 17.0), span])
    assert caught.value.code == code
    assert f"{span[0]:g}" in caught.value.what


def test_a_still_in_a_log_without_noise(scene: ScanScene):
    log, T_arkit_world = scan_log(scene, seed=0, noise=NO_NOISE)
    stills, _ = clamped_stills(log, path=1.0)
    np.testing.assert_allclose(
        stills[0].T_world_phone, T_arkit_world @ scene.T_world_clamped, atol=1e-9
    )


def test_what_chance_explains_does_not_disagree():
    rng = np.random.default_rng(0)
    covariance = np.diag([0.01] * 3 + [0.004] * 3) ** 2
    T = np.tile(np.eye(4), (3, 1, 1))
    T[:, :3, :3] = Rotation.from_rotvec(rng.normal(0, 0.01, (3, 3))).as_matrix()
    T[:, :3, 3] = rng.normal(0, 0.004, (3, 3))
    covariances = np.tile(covariance, (3, 1, 1))
    assert disagreeing(T, covariances) is None
    assert disagreeing(T[:1], covariances[:1]) is None
    T[1, 0, 3] += 0.05
    pair = disagreeing(T, covariances)
    assert pair is not None
    assert 1 in pair
