"""Two trackers of one motion: the mount is found within its bounds, or refused and said why."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.calibration.hand_eye.hand_eye import HandEye, free_in_words, solve
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.uncertainty import between, bounds_95
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.calibration.hand_eye.two_trackers import Coloured, TwoTrackers, two_trackers


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
    for seed in range(30):
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


def _erring(seed: int) -> TwoTrackers:
    """A take in which all errors go on from one moment to the next."""
    rng = np.random.default_rng([seed, 1])
    coloured = Coloured(
        pose_deg=rng.uniform(0, 1),
        pose_mm=rng.uniform(0, 10),
        stamp_s=rng.uniform(0, 0.03),
        seconds=rng.uniform(0.3, 3),
        scale=0.01,
        turn_deg=rng.uniform(0, 0.15),
        alike_deg=0.1,
        alike_mm=1.0,
    )
    return two_trackers(seed, drift=rng.uniform(0, 0.01), seconds=30, coloured=coloured)


def test_bounds_are_neither_too_small_nor_too_large_where_errors_go_on():
    takes = [_erring(seed) for seed in range(30)]
    found = [solve(take.phone, take.target) for take in takes]
    square = np.array([_distance(f, take) for f, take in zip(found, takes, strict=True)]) / 6
    # Half the covariance doubles it, twice the covariance halves it.
    assert 0.62 < square.mean() < 1.2
    steps = [between(f.T_phone_target, t.T_phone_target) for f, t in zip(found, takes, strict=True)]
    errors = np.array([[np.linalg.norm(s[3:]) * 1e3, np.linalg.norm(s[:3])] for s in steps])
    bounds = np.array([bounds_95(f.covariance) for f in found]) * [1, np.radians(1)]
    assert (errors < bounds).mean() >= 0.9
    wide = np.median(bounds, axis=0) / np.median(errors, axis=0)
    assert (wide > 1.4).all()
    assert (wide < 3.0).all()


def test_a_phone_that_errs_in_lengths_moves_no_mount():
    take = two_trackers(12, drift=0.002, seconds=30)
    T = take.phone.T.copy()
    T[:, :3, 3] *= 0.97
    found = solve(replace(take.phone, T=T), take.target)
    assert found.scale == pytest.approx(0.03, abs=0.006)
    assert _distance(found, take) < chi2.ppf(0.999, 6)
    right = solve(take.phone, take.target)
    assert right.scale == pytest.approx(0.0, abs=0.006)


def test_drift_is_no_scale():
    scales = [
        solve(take.phone, take.target).scale
        for take in (two_trackers(seed, noise=0.2, drift=0.01) for seed in range(8))
    ]
    assert abs(np.mean(scales)) < 0.007


def test_drift_and_what_is_left_with_and_without_it_are_told():
    take = two_trackers(13, noise=0.3, drift=0.0, wild=0.0, seconds=30)
    still = solve(take.phone, take.target)
    assert still.drift.metres < 0.01
    assert still.rest_mm == pytest.approx(still.rms_mm, abs=1.0)
    T = take.phone.T.copy()
    T[:, 0, 3] += np.linspace(0, 0.06, len(T))
    found = solve(replace(take.phone, T=T), take.target)
    assert found.drift.metres == pytest.approx(0.06, abs=0.015)
    path = np.linalg.norm(np.diff(take.phone.T[::15, :3, 3], axis=0), axis=1).sum()
    assert found.drift.walked == pytest.approx(path, rel=0.15)
    assert found.drift.per_metre == pytest.approx(found.drift.metres / found.drift.walked)
    assert found.rest_mm > found.rms_mm + 8


@pytest.mark.parametrize("whose", ["phone", "target"])
def test_a_log_that_lost_its_way_is_refused_with_where_and_how_far(whose: str):
    take = two_trackers(14, seconds=40)
    streams = {"phone": take.phone, "target": take.target}
    stream = streams[whose]
    since = stream.times - stream.times[0]
    T = stream.T.copy()
    T[:, :3, 3] += np.maximum(since - 31, 0)[:, None] ** 2 * [0.2, 0.1, 0.0]
    streams[whose] = replace(stream, T=T)
    refusal = _refusal(**streams)
    assert refusal.code == "calibration-lost"
    assert refusal.what.startswith("The phone's" if whose == "phone" else "The other tracker's")
    first, last = (float(word) for word in refusal.where.split() if word[0].isdigit())
    assert first == pytest.approx(31.5, abs=1.5)
    assert last > 38
    metres = float(refusal.what.split(" m ")[0].split()[-1])
    assert metres == pytest.approx(9**2 * np.hypot(0.2, 0.1), rel=0.15)
    assert "Cut" in refusal.fix


def test_drift_of_working_odometry_is_not_refused_and_twice_what_is_believed_is():
    take = two_trackers(15, drift=0.0, seconds=30)
    walked = solve(take.phone, take.target).drift.walked
    for part, refused in ((0.02, False), (0.08, True)):
        T = take.phone.T.copy()
        T[:, 2, 3] += np.linspace(0, part * walked, len(T))
        phone = replace(take.phone, T=T)
        if refused:
            assert _refusal(phone, take.target).code == "calibration-lost"
        else:
            assert solve(phone, take.target).drift.per_metre == pytest.approx(part, rel=0.3)


def test_stamps_that_wander_cost_little():
    """Errors of 30 ms along the motion: what is across it still shows the mount."""
    errors: list[float] = []
    for seed in range(6):
        take = two_trackers(seed, wild=0.0, coloured=Coloured(stamp_s=0.03, seconds=0.5))
        found = solve(take.phone, take.target)
        assert found.kept.mean() > 0.75
        step = between(found.T_phone_target, take.T_phone_target)
        errors.append(float(np.degrees(np.linalg.norm(step[:3]))))
    assert np.median(errors) < 0.6


def test_a_motion_that_leaves_two_directions_open_is_refused_by_them():
    refusals: list[InputError] = []
    for seed in range(6):
        take = two_trackers(seed, "slow", noise=10, seconds=8)
        try:
            solve(take.phone, take.target)
        except InputError as refusal:
            refusals.append(refusal)
    poor = [refusal for refusal in refusals if refusal.code == "calibration-poor"]
    assert poor
    assert "the height of the object" in poor[0].what
    assert ";" in poor[0].what
    assert "two directions that are not parallel" in poor[0].fix


def test_where_an_open_direction_is_guessed_the_bounds_hold_the_guess():
    for seed in range(5):
        take = two_trackers(seed, "yaw")
        found = solve(take.phone, take.target)
        step = between(found.T_phone_target, take.T_phone_target)
        along = found.open[0].step
        spread = float(along @ found.covariance @ along)
        assert float(along @ step) ** 2 < 4 * spread


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
