"""Two trackers of one motion: the mount is found within its bounds, or refused and said why."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.mount.hand_eye.solve import HandEye, free_in_words, solve
from ingest.mount.hand_eye.streams import PoseStream
from ingest.mount.uncertainty import between, bounds_95
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.mount.hand_eye.two_trackers import TwoTrackers, two_trackers


def _distance(found: HandEye, truth: TwoTrackers) -> float:
    step = between(found.T_phone_target, truth.T_phone_target)
    return float(step @ np.linalg.solve(found.covariance, step))


def _refusal(phone: PoseStream, target: PoseStream) -> InputError:
    with pytest.raises(InputError) as caught:
        solve(phone, target)
    return caught.value


def test_the_truth_is_within_the_bounds():
    rng = np.random.default_rng(0)
    distances, sure = [], []
    for seed in range(40):
        take = two_trackers(
            seed, noise=rng.uniform(0, 3), drift=rng.uniform(0, 0.01), wild=rng.uniform(0, 0.3)
        )
        found = solve(take.phone, take.target)
        assert found.open == ()
        assert found.offset == pytest.approx(take.offset, abs=5e-3)
        distances.append(_distance(found, take))
        sure.append(bounds_95(found.covariance))
    inside = np.mean(np.array(distances) < chi2.ppf(0.95, 6))
    assert inside >= 0.9
    # Honest, and not because they are wide.
    assert np.median(distances) > 2
    assert np.median([s.mm for s in sure]) < 5
    assert np.median([s.deg for s in sure]) < 0.3


def test_without_noise_it_is_exact():
    take = two_trackers(1, noise=0.0, drift=0.0, wild=0.0)
    X = take.T_phone_target
    phone = PoseStream(take.target.times, take.T_world_camera @ take.target.T @ inverse(X))
    found = solve(phone, take.target, one_by_one=True)
    np.testing.assert_allclose(found.T_phone_target, X, atol=1e-5)
    np.testing.assert_allclose(found.T_world_camera[0], take.T_world_camera, atol=1e-4)


def test_pushed_over_the_floor_the_height_stays_open():
    for seed in range(5):
        take = two_trackers(seed, "yaw")
        found = solve(take.phone, take.target)
        assert [each.words for each in found.open] == ["the height of the object"]
        assert "20 degrees" in free_in_words(found.open)[0]
        assert _distance(found, take) < chi2.ppf(0.999, 6)
        step = between(found.T_phone_target, take.T_phone_target)
        up = take.phone.T[:, 1, :3].mean(axis=0)
        up /= np.linalg.norm(up)
        across = step[3:] - up * (up @ step[3:])
        assert np.linalg.norm(across) < 0.02
        # The open direction holds no guess made of noise: the target is at the phone's height.
        assert abs(up @ found.T_phone_target[:3, 3]) < 0.02


@pytest.mark.parametrize("kind", ["shift", "tiny"])
def test_hardly_turned_is_refused_by_what_is_missing(kind: str):
    take = two_trackers(3, kind)
    refusal = _refusal(take.phone, take.target)
    assert refusal.code == "calibration-turns"
    assert "the place of the object" in refusal.what
    assert "turn the object" in refusal.fix


def _quaternions(T: np.ndarray, order: list[int]) -> np.ndarray:
    out = T.copy()
    numbers = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, order]
    out[:, :3, :3] = Rotation.from_quat(numbers).as_matrix()
    return out


_FLIP = np.diag([1.0, 1.0, -1.0, 1.0])


@pytest.mark.parametrize("whose", ["phone", "target"])
@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (inverse, "is inverted"),
        (lambda T: _quaternions(T, [3, 0, 1, 2]), "w first, read as if x were first"),
        (lambda T: _quaternions(T, [1, 2, 3, 0]), "x first, read as if w were first"),
        (lambda T: _FLIP @ T @ _FLIP, "mirrored"),
    ],
    ids=["inverted", "wxyz", "xyzw", "mirrored"],
)
def test_a_stream_read_the_wrong_way_is_named(
    wrong: Callable[[np.ndarray], np.ndarray], said: str, whose: str
):
    take = two_trackers(4)
    streams = {"phone": take.phone, "target": take.target}
    streams[whose] = replace(streams[whose], T=wrong(streams[whose].T))
    refusal = _refusal(**streams)
    assert refusal.code == "calibration-stream"
    assert said in refusal.what
    assert whose in refusal.what


def test_both_inverted_is_refused_when_the_camera_is_far():
    takes = (two_trackers(seed, seconds=8) for seed in range(100))
    take = next(t for t in takes if np.linalg.norm(t.T_world_camera[:3, 3]) > 2.5)
    phone = replace(take.phone, T=inverse(take.phone.T))
    target = replace(take.target, T=inverse(take.target.T), covariance=None)
    assert _refusal(phone, target).code == "calibration-far"


def test_recordings_of_different_motions():
    one, other = two_trackers(7), two_trackers(8)
    refusal = _refusal(one.phone, other.target)
    assert refusal.code in ("calibration-clocks", "calibration-apart")


def test_millimetres_for_metres():
    take = two_trackers(9)
    T = take.target.T.copy()
    T[:, :3, 3] *= 1000
    assert _refusal(take.phone, replace(take.target, T=T)).code == "calibration-apart"


def test_too_few_poses():
    take = two_trackers(10, seconds=4)
    few = PoseStream(take.target.times[::8], take.target.T[::8])
    assert _refusal(take.phone, few).code in ("calibration-short", "calibration-clocks")


def test_a_clock_in_another_epoch_is_found():
    take = two_trackers(11)
    found = solve(take.phone, replace(take.target, times=take.target.times + 1.7e9))
    assert found.offset == pytest.approx(take.offset - 1.7e9, abs=5e-3)
    R = Rotation.from_matrix(found.T_phone_target[:3, :3].T @ take.T_phone_target[:3, :3])
    assert np.degrees(R.magnitude()) < 0.5
